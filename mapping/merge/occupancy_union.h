// The occupancy of two maps as that of one.
#pragma once

#include <vector>

#include "mapping/dense/dense_point.h"
#include "mapping/occupancy_map.h"

namespace slcmap {

// In the grid of the first. A cell is occupied where a point of the united cloud is, or one of the
// maps says so and the other does not say that it is free; free where one of them says so and
// neither that it is occupied; else unknown. Of two that contradict each other without a point, as
// of what stood there once, it is free. Points stand for patches that are spacing_m wide.
OccupancyMap UniteOccupancy(const OccupancyMap& first, const OccupancyMap& second,
                            const RigidTransform& T_first_second,
                            const std::vector<DensePoint>& united, double spacing_m);

}  // namespace slcmap
