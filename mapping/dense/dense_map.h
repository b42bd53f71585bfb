// Everything dense of a map: depth of the views, their agreement, and one cloud.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "data/progress.h"
#include "mapping/dense/dense_options.h"
#include "mapping/dense/dense_point.h"
#include "mapping/dense/depth_grid.h"
#include "mapping/views/view.h"

namespace slcmap {

struct DenseMap {
  std::vector<DensePoint> points;
  int64_t views = 0;                 // looked at
  int64_t views_without_images = 0;  // of which nothing could be had
};

// Gets the confirmed depth of views in their order, one at a time, from another thread than the
// calling one where there are several.
using DepthSink = std::function<void(std::size_t view, const DepthGrid& depth)>;

// Finds the depth of those views that are far enough apart, keeps what several agree on, and fuses
// it. The same views give the same map, to the last bit, with any number of threads; memory does
// not grow with their number but by the surface that they see. Once progress says so, the map is
// that of the views so far. Throws ConfigError when an option is not plausible.
DenseMap BuildDense(const Views& views, const ViewImages& images, const DenseOptions& options,
                    const Progress& progress = {}, const DepthSink& sink = {});

}  // namespace slcmap
