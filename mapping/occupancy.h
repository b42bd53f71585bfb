// Occupied and free space, from what the keyframes saw.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "data/progress.h"
#include "mapping/map.h"
#include "mapping/map_options.h"
#include "odometry/run.h"

namespace slcmap {

// The rays from each keyframe's left camera to each point of the map whose landmark it saw.
std::vector<RayBundle> KeyframeRays(const OdometryRun& run, const std::vector<MapPoint>& points);

// Follows the rays; counts those that leave the octree as `warnings` of the kind kRayOutOfOctree.
// Once progress says so, later rays are left out. Throws ConfigError, naming what would do, when
// the rays would take more than max_voxels.
OccupancyMap MapOccupancy(const std::vector<RayBundle>& rays, const OccupancyOptions& options,
                          std::map<std::string, int64_t>* warnings, const Progress& progress = {});

inline constexpr const char* kRayOutOfOctree = "rays_out_of_octree";

}  // namespace slcmap
