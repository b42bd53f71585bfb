// The planes of a building as cells.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mapping/building/building.h"
#include "mapping/planes/plane_grid.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

struct BoundedPlane {
  PlaneGrid grid;
  cv::Mat1b inside;    // by cell: not 0 within the outline, and in no opening
  double sigma_m = 0;  // of the plane's offset
  double reach_m = 0;  // how far from what was measured of it, it may be filled
  bool is_wall = false;
  bool is_measured = true;  // else its height is its storey's, and points on it are placed by what
                            // is measured around alone
};

// Walls as far as their outlines reach, without their openings; floors and ceilings over their
// rooms, without the holes in these.
std::vector<BoundedPlane> BoundedPlanes(const Building& building, const PlaneOptions& options);

}  // namespace slcmap
