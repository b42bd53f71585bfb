#include "odometry/window/window_state.h"

namespace slcmap {

Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry) {
  const Eigen::Vector3d p_camera =
      Eigen::Vector3d(landmark.point[0], landmark.point[1], 1) / landmark.inverse_depth_per_m();
  return landmark.host()->T_world_imu() * (geometry.T_imu_camera[0] * p_camera);
}

}  // namespace slcmap
