#include "mapping/occupancy.h"

#include <unordered_map>

namespace slcmap {

OccupancyMap MapOccupancy(const OdometryRun& run, const std::vector<MapPoint>& points,
                          const OccupancyOptions& options) {
  std::unordered_map<int64_t, const MapPoint*> point_of_landmark;
  for (const MapPoint& point : points) {
    for (const int64_t id : point.landmark_ids) point_of_landmark[id] = &point;
  }
  OccupancyMap occupancy(options.resolution_m);
  for (const Keyframe& keyframe : run.keyframes) {
    std::vector<Eigen::Vector3d> seen_world;
    for (const KeyframeObservation& observation : keyframe.observations) {
      const auto point = point_of_landmark.find(observation.landmark_id);
      if (point != point_of_landmark.end()) seen_world.push_back(point->second->p_world);
    }
    const RigidTransform T_world_camera = keyframe.T_world_imu * run.rectified_rig.T_imu_camera[0];
    occupancy.InsertRays(T_world_camera.translation, seen_world, options.max_range_m);
  }
  return occupancy;
}

}  // namespace slcmap
