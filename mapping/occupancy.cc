#include "mapping/occupancy.h"

#include <spdlog/fmt/fmt.h>

#include <unordered_map>

#include "data/error.h"
#include "mapping/occupancy_estimate.h"

namespace slcmap {
namespace {

void CheckSize(const std::vector<RayBundle>& rays, const OccupancyOptions& options) {
  const VoxelEstimate estimate(rays, options.max_range_m);
  const double voxels = estimate.Voxels(options.resolution_m);
  if (voxels <= options.max_voxels) return;
  throw ConfigError(fmt::format(
      "mapping.occupancy.resolution_m: found {}, which takes some {:.3g} voxels; expected at least "
      "{:.2g}, for at most {} voxels (mapping.occupancy.max_voxels)",
      options.resolution_m, voxels, estimate.LeastResolution_m(options.max_voxels),
      options.max_voxels));
}

}  // namespace

std::vector<RayBundle> KeyframeRays(const OdometryRun& run, const std::vector<MapPoint>& points) {
  std::unordered_map<int64_t, const MapPoint*> point_of_landmark;
  for (const MapPoint& point : points) {
    for (const int64_t id : point.landmark_ids) point_of_landmark[id] = &point;
  }
  std::vector<RayBundle> rays;
  for (const Keyframe& keyframe : run.keyframes) {
    RayBundle bundle;
    bundle.p_world_camera = (keyframe.T_world_imu * run.rectified_rig.T_imu_camera[0]).translation;
    for (const KeyframeObservation& observation : keyframe.observations) {
      const auto point = point_of_landmark.find(observation.landmark_id);
      if (point != point_of_landmark.end()) bundle.p_world.push_back(point->second->p_world);
    }
    rays.push_back(std::move(bundle));
  }
  return rays;
}

OccupancyMap MapOccupancy(const std::vector<RayBundle>& rays, const OccupancyOptions& options,
                          std::map<std::string, int64_t>* warnings, const Progress& progress) {
  CheckSize(rays, options);
  OccupancyMap occupancy(options.resolution_m);
  const int64_t left_out = occupancy.Insert(rays, options.max_range_m, progress);
  if (left_out > 0) (*warnings)[kRayOutOfOctree] += left_out;
  return occupancy;
}

}  // namespace slcmap
