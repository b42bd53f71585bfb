// The poses of a map by their stamps.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "mapping/map.h"

namespace slcmap {

// Of the rig's body, in world, for all keyframes and all images of the trajectory.
inline std::unordered_map<int64_t, RigidTransform> PosesByStamp(const MapResult& map) {
  std::unordered_map<int64_t, RigidTransform> poses;
  for (const Trajectory* trajectory : {&map.keyframes, &map.trajectory}) {
    for (const StampedPose& pose : *trajectory) poses.emplace(pose.stamp_ns, pose.T_world_imu);
  }
  return poses;
}

}  // namespace slcmap
