// What measured rays say of a plane.
#pragma once

#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/planes/plane_grid.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

// By cell: the rays that go through it to an end clearly behind it, from either side.
cv::Mat1i CountPasses(const PlaneGrid& grid, const std::vector<Sights>& sights,
                      const PlaneOptions& options);

}  // namespace slcmap
