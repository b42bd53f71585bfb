#include "mapping/occupancy.h"

#include <unordered_map>

namespace slcmap {

OccupancyMap MapOccupancy(const OdometryRun& run, const std::vector<MapPoint>& points,
                          const OccupancyOptions& options) {
  std::unordered_map<int64_t, const MapPoint*> point_of_landmark;
  for (const MapPoint& point : points) {
    for (const int64_t id : point.landmark_ids) point_of_landmark[id] = &point;
  }
  std::vector<RayBundle> bundles;
  for (const Keyframe& keyframe : run.keyframes) {
    RayBundle bundle;
    bundle.p_world_camera = (keyframe.T_world_imu * run.rectified_rig.T_imu_camera[0]).translation;
    for (const KeyframeObservation& observation : keyframe.observations) {
      const auto point = point_of_landmark.find(observation.landmark_id);
      if (point != point_of_landmark.end()) bundle.p_world.push_back(point->second->p_world);
    }
    bundles.push_back(std::move(bundle));
  }
  OccupancyMap occupancy(options.resolution_m);
  occupancy.Insert(bundles, options.max_range_m);
  return occupancy;
}

}  // namespace slcmap
