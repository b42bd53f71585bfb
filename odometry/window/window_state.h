// What the sliding window holds: states, landmarks, and the prior.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "odometry/imu/preintegration.h"
#include "odometry/residuals/point_residual.h"
#include "odometry/residuals/pose_manifold.h"
#include "odometry/residuals/prior_residual.h"

namespace slcmap {

using PoseBlock = std::array<double, kPoseSize>;
using SpeedBiasBlock = std::array<double, kSpeedBiasSize>;

// The state of the IMU body at one image, with what the image showed. Its address is fixed while it
// lives: residuals and the prior point into it.
struct FrameState {
  int64_t id = 0;
  int64_t stamp_ns = 0;
  PoseBlock pose{0, 0, 0, 0, 0, 0, 1};
  SpeedBiasBlock speed_bias{};
  // Where the prior has linearised the blocks; unset while it does not touch them.
  std::optional<PoseBlock> pose_linearization;
  std::optional<SpeedBiasBlock> speed_bias_linearization;
  std::unique_ptr<Preintegration> from_previous;      // from the frame before; none for the oldest
  std::map<int64_t, StereoMeasurement> measurements;  // by landmark id
  bool stands_still = false;

  RigidTransform T_world_imu() const { return PoseFromBlock(pose.data()); }
  Eigen::Vector3d velocity() const { return Eigen::Vector3d::Map(speed_bias.data()); }
  Eigen::Vector3d gyro_bias() const { return Eigen::Vector3d::Map(speed_bias.data() + 3); }
  Eigen::Vector3d accel_bias() const { return Eigen::Vector3d::Map(speed_bias.data() + 6); }
};

// A point, by its inverse depth in the left camera of the frame that hosts it: the oldest frame of
// the window that saw it.
struct PointLandmark {
  int64_t id = 0;
  std::vector<FrameState*> frames;         // that saw it, oldest first; the first is the host
  std::array<double, kPointSize> point{};  // x, y on z = 1 and the inverse depth in 1 / m
  bool triangulated = false;
  int released_frames = 0;  // that saw it too, but have left the window

  FrameState* host() const { return frames.front(); }
  double inverse_depth_per_m() const { return point[2]; }
};

struct WindowState {
  std::deque<std::unique_ptr<FrameState>> frames;  // oldest first
  std::map<int64_t, PointLandmark> landmarks;      // by id
  Prior prior;
};

// The position of a triangulated landmark.
Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry);

}  // namespace slcmap
