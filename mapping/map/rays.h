// Occupied and free space from what keyframes and views saw, and a map as what its building is made
// of.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "data/core/progress.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"
#include "mapping/map/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The rays from each keyframe's left camera to each point of the map whose landmark it saw.
std::vector<RayBundle> KeyframeRays(const OdometryRun& run, const std::vector<MapPoint>& points);

// Follows the rays; counts those that leave the octree as `warnings` of the kind kRayOutOfOctree.
// Once progress says so, later rays are left out. Throws what OccupancyMap::Insert throws.
OccupancyMap MapOccupancy(const std::vector<RayBundle>& rays, const OccupancyOptions& options,
                          std::map<std::string, int64_t>* warnings, const Progress& progress = {});

inline constexpr const char* kRayOutOfOctree = "rays_out_of_octree";

// Rays from each image that shows lines or marks of a map to places along what it shows of them, by
// stamp and camera. Where walls are blank and stereo measures nothing, these are what is known to
// be free. Their ends are as uncertain as their lines, and at least as uncertain as lines are that
// turn out a little wrong.
std::vector<ViewRays> CollectLineRays(const MapResult& map);

// All points of the dense cloud, the lines, and the places of the trajectory, with the rays and
// what the lines add to them.
inline BuildingInput MakeBuildingInput(const MapResult& map, std::vector<ViewRays> rays) {
  BuildingInput input;
  for (const DensePoint& point : map.dense) {
    input.points.push_back({point.p_world, point.normal_world, point.sigma_m});
  }
  input.lines = map.lines;
  input.rays = std::move(rays);
  std::vector<ViewRays> of_lines = CollectLineRays(map);
  std::move(of_lines.begin(), of_lines.end(), std::back_inserter(input.rays));
  for (const StampedPose& pose : map.trajectory) {
    input.trajectory_world.push_back(pose.T_world_imu.translation);
  }
  return input;
}

}  // namespace slcmap::mapping
