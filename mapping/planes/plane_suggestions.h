// Planes that the structure of a building suggests.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/dense/dense_point.h"
#include "mapping/planes/plane_grid.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

struct SuggestedPlane {
  PlaneGrid grid;
  cv::Mat1b near;      // by cell: not 0 where it is near enough to what suggests the plane
  double weight = 0;   // of what suggests it, in points of the dense cloud
  double sigma_m = 0;  // of that from the plane
};

// Upright planes through level lines and measured surfaces, a plane for each side that it may be
// seen from, and level ones through measured surfaces. Most of them are no surfaces, or not
// everywhere: what the images say of them is to be asked.
std::vector<SuggestedPlane> SuggestPlanes(const std::vector<DensePoint>& dense,
                                          const std::vector<MapLine>& lines, double voxel_m,
                                          const PlaneOptions& options);

}  // namespace slcmap
