// Occupied and free space, from what the keyframes saw.
#pragma once

#include <vector>

#include "mapping/map.h"
#include "mapping/options.h"
#include "odometry/run.h"

namespace slcmap {

// Follows the ray from each keyframe's left camera to each point of the map whose landmark it saw.
OccupancyMap MapOccupancy(const OdometryRun& run, const std::vector<MapPoint>& points,
                          const OccupancyOptions& options);

}  // namespace slcmap
