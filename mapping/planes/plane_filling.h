// Surfaces that stereo does not measure, as blank walls, filled where planes that the structure of
// the building suggests agree with the images.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "data/progress.h"
#include "mapping/building/building_input.h"
#include "mapping/dense/dense_point.h"
#include "mapping/lines/sight_depths.h"
#include "mapping/planes/plane_options.h"
#include "mapping/views/view.h"

namespace slcmap {

// What is known of a building before.
struct MeasuredBuilding {
  const std::vector<DensePoint>& dense;
  double voxel_m = 0.04;  // between the points
  const std::vector<MapLine>& lines;
  const std::vector<Sights>& sights;  // rays to what was measured
  const SightDepths& depths;          // of the views
};

// Points of source kFilledPlane, where the views agree on a suggested plane, nothing was measured,
// and no ray goes through. The same with any number of threads. Once progress says so, there are
// none.
std::vector<DensePoint> FillPlanes(const Views& views, const ViewImages& images,
                                   const MeasuredBuilding& measured, const PlaneOptions& options,
                                   int threads, const Progress& progress = {});

}  // namespace slcmap
