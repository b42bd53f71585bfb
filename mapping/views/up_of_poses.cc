#include "mapping/views/up_of_poses.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numbers>

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kNear_s = 0.02;
constexpr int kLeastPoses = 20;
// Motion averages out to a small part of gravity; a frame that is another one's turns with the rig.
constexpr double kMostTilt_rad = 10 * std::numbers::pi / 180, kLeastForce_m_s2 = 8;

// The sample nearest in time; none where that is far. Samples are sorted.
const ImuSample* Nearest(const std::vector<ImuSample>& imu, int64_t stamp_ns) {
  const auto is_before = [](const ImuSample& sample, int64_t ns) { return sample.stamp_ns < ns; };
  const auto after = std::lower_bound(imu.begin(), imu.end(), stamp_ns, is_before);
  int64_t least_ns = ToNanoseconds(kNear_s);
  const ImuSample* nearest = nullptr;
  const auto consider = [&](const ImuSample& sample) {
    const int64_t off_ns = std::abs(sample.stamp_ns - stamp_ns);
    if (off_ns > least_ns) return;
    least_ns = off_ns;
    nearest = &sample;
  };
  if (after != imu.end()) consider(*after);
  if (after != imu.begin()) consider(*std::prev(after));
  return nearest;
}

}  // namespace

std::optional<Vector3d> MeanForceAt(const std::vector<OnlineState>& states,
                                    const std::vector<ImuSample>& imu,
                                    double camera_time_offset_s) {
  Vector3d sum = Vector3d::Zero();
  double norms_m_s2 = 0;
  int count = 0;
  for (const OnlineState& state : states) {
    const ImuSample* sample = Nearest(imu, state.stamp_ns + ToNanoseconds(camera_time_offset_s));
    if (!sample || !sample->specific_force_m_s2.allFinite()) continue;
    sum += state.T_world_imu.rotation * sample->specific_force_m_s2;
    norms_m_s2 += sample->specific_force_m_s2.norm();
    ++count;
  }
  if (count < kLeastPoses || norms_m_s2 < kLeastForce_m_s2 * count) return std::nullopt;
  return sum / count;
}

std::string WhatIsNotUp(const Vector3d& mean_force_m_s2) {
  const double norm_m_s2 = mean_force_m_s2.norm();
  if (norm_m_s2 < kLeastForce_m_s2) {
    return fmt::format(
        "the accelerometer's mean in the world of the poses is {:.1f} m/s^2, expected 9.8: are the "
        "poses those of the IMU, as T_world_imu, at the images' times?",
        norm_m_s2);
  }
  Vector3d up = mean_force_m_s2 / norm_m_s2;
  if (up.z() > std::cos(kMostTilt_rad)) return "";
  up = (100 * up).array().round() / 100 + 0.0;  // as it is told, without the sign of a zero
  return fmt::format(
      "by the accelerometer up is ({:.2f}, {:.2f}, {:.2f}) in the world of the poses, expected z: "
      "turn that world, or give poses of the IMU",
      up.x(), up.y(), up.z());
}

}  // namespace slcmap
