#include "odometry/window/window_state.h"

namespace slcmap {

Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry) {
  const FrameState& host = *landmark.host();
  const Eigen::Vector2d& left = host.measurements.at(landmark.id).left;
  const Eigen::Vector3d p_camera =
      Eigen::Vector3d(left.x(), left.y(), 1) / landmark.inverse_depth_per_m;
  return host.T_world_imu() * (geometry.T_imu_camera[0] * p_camera);
}

}  // namespace slcmap
