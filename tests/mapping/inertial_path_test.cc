#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "data/core/rigid_transform.h"
#include "mapping/map/refinement.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int64_t kImu_ns = 5'000'000, kFrame_ns = 50'000'000;
constexpr double kEnd_s = 6;
const Vector3d kGyroBias_rad_s(0.01, -0.02, 0.015), kAccelBias_m_s2(0.1, 0.05, -0.08);

// A rig that swings along x and z while it turns about z.
struct Swing {
  static RigidTransform PoseAt(double t_s) {
    return {ExpRotation({0, 0, 0.8 * std::sin(1.5 * t_s)}),
            {0.6 * std::sin(2 * t_s), 0.4 * t_s, 0.1 * std::cos(3 * t_s)}};
  }
  static ImuSample SampleAt(int64_t stamp_ns) {
    const double t_s = ToSeconds(stamp_ns);
    const Vector3d acceleration(-2.4 * std::sin(2 * t_s), 0, -0.9 * std::cos(3 * t_s));
    const Vector3d up(0, 0, kGravity_m_s2);
    return {stamp_ns, Vector3d(0, 0, 1.2 * std::cos(1.5 * t_s)) + kGyroBias_rad_s,
            PoseAt(t_s).rotation.conjugate() * (acceleration + up) + kAccelBias_m_s2};
  }
};

// Keyframes at the truth, `every` frames; online poses that drift sideways by 10 cm/s from each
// keyframe to the next, and jump back there.
OdometryRun SwingRun(int every) {
  OdometryRun run;
  for (int64_t t = 0; ToSeconds(t) <= kEnd_s + 0.5; t += kImu_ns) {
    run.imu.push_back(Swing::SampleAt(t));
  }
  for (int i = 0; i * ToSeconds(kFrame_ns) <= kEnd_s; ++i) {
    const int64_t stamp_ns = i * kFrame_ns;
    const RigidTransform truth = Swing::PoseAt(ToSeconds(stamp_ns));
    OnlineState state{.stamp_ns = stamp_ns, .T_world_imu = truth};
    state.T_world_imu.translation.y() += 0.1 * ToSeconds(i % every * kFrame_ns);
    state.gyro_bias_rad_s = kGyroBias_rad_s;
    state.accel_bias_m_s2 = kAccelBias_m_s2;
    run.states.push_back(state);
    if (i % every == 0) run.keyframes.push_back({i, 0, stamp_ns, truth, {}, {}});
  }
  return run;
}

struct LargestErrors {
  double position_m = 0, rotation_rad = 0;
};

LargestErrors GetErrors(const OdometryRun& run) {
  std::map<std::string, int64_t> warnings;
  LargestErrors largest;
  for (const StampedPose& pose : RefineTrajectory(run, &warnings)) {
    const RigidTransform truth = Swing::PoseAt(ToSeconds(pose.stamp_ns));
    const RigidTransform error = truth.Inverse() * pose.T_world_imu;
    largest.position_m = std::max(largest.position_m, error.translation.norm());
    largest.rotation_rad = std::max(largest.rotation_rad, LogRotation(error.rotation).norm());
  }
  EXPECT_TRUE(warnings.empty());
  return largest;
}

TEST(InertialPath, OnlinePosesThatJumpAtKeyframesAreNotFollowed) {
  const LargestErrors errors = GetErrors(SwingRun(6));
  EXPECT_LT(errors.position_m, 3e-4);  // of 15 mm
  EXPECT_LT(errors.rotation_rad, 1e-5);
  OdometryRun without = SwingRun(6);
  without.imu.clear();
  EXPECT_GT(GetErrors(without).position_m, 0.02);
}

TEST(InertialPath, ConstantErrorsOfTheImuChangeLittleOverShortTimes) {
  OdometryRun run = SwingRun(6);
  for (OnlineState& state : run.states) {
    state.accel_bias_m_s2 += Vector3d(0.02, -0.02, 0.02);
    state.gyro_bias_rad_s += Vector3d(0.002, 0.002, -0.002);
  }
  const LargestErrors errors = GetErrors(run);
  EXPECT_LT(errors.position_m, 7e-4);  // 0.035 m/s^2 bend 0.3 s by 0.4 mm
  EXPECT_LT(errors.rotation_rad, 1e-4);
}

TEST(InertialPath, OverASecondOdometryTellsWhatTheForceIsOffBy) {
  OdometryRun run = SwingRun(24);
  for (OnlineState& state : run.states) {
    state.T_world_imu = Swing::PoseAt(ToSeconds(state.stamp_ns));
    state.accel_bias_m_s2.z() += 0.05;
  }
  EXPECT_LT(GetErrors(run).position_m, 4e-3);  // 9 mm otherwise
}

// The true poses of every frame from 1 s on.
Trajectory MakePath(double duration_s) {
  Trajectory path;
  for (int64_t t = ToNanoseconds(1); ToSeconds(t) <= 1 + duration_s; t += kFrame_ns) {
    path.push_back({t, Swing::PoseAt(ToSeconds(t))});
  }
  return path;
}

TEST(InertialPath, LongWaysAndMissingSamplesAreLeftToOdometry) {
  OdometryRun run = SwingRun(6);
  Trajectory longer = MakePath(1.6), path = MakePath(0.3);
  EXPECT_FALSE(InertialPath(run).Follow(run.states.front(), &longer));
  EXPECT_TRUE(InertialPath(run).Follow(run.states.front(), &path));
  std::erase_if(run.imu, [](const ImuSample& sample) {
    return std::abs(ToSeconds(sample.stamp_ns) - 1.1) < 0.02;
  });
  EXPECT_FALSE(InertialPath(run).Follow(run.states.front(), &path));
  run.imu.clear();
  EXPECT_FALSE(InertialPath(run).Follow(run.states.front(), &path));
}

TEST(InertialPath, AnImuWithAFaultIsLeftToOdometry) {
  OnlineState biases;
  biases.gyro_bias_rad_s = kGyroBias_rad_s;
  biases.accel_bias_m_s2 = kAccelBias_m_s2;
  Trajectory path = MakePath(0.8);
  OdometryRun shocked = SwingRun(6), turned = SwingRun(6);
  for (ImuSample& sample : shocked.imu) sample.specific_force_m_s2.x() += 0.6;
  for (ImuSample& sample : turned.imu) sample.angular_velocity_rad_s.z() += 0.05;
  EXPECT_FALSE(InertialPath(shocked).Follow(biases, &path));
  EXPECT_FALSE(InertialPath(turned).Follow(biases, &path));
  EXPECT_TRUE(InertialPath(SwingRun(6)).Follow(biases, &path));
}

// The clock and the turn of the IMU that the run has found.
TEST(InertialPath, KnowsTheRunsCalibration) {
  OdometryRun run = SwingRun(6);
  const Vector3d turn_rad(0.01, -0.02, 0.03);
  run.rectified_rig.camera_time_offset_s = 0.006;
  run.calibration.push_back({.time_offset_s = 0.004, .imu_rotation_rad = turn_rad});
  for (ImuSample& sample : run.imu) {
    sample = Swing::SampleAt(sample.stamp_ns);
    const Eigen::Quaterniond R_true_given = ExpRotation(-turn_rad);
    sample.stamp_ns += ToNanoseconds(0.01);
    sample.angular_velocity_rad_s =
        R_true_given * (sample.angular_velocity_rad_s - kGyroBias_rad_s) + kGyroBias_rad_s;
    sample.specific_force_m_s2 =
        R_true_given * (sample.specific_force_m_s2 - kAccelBias_m_s2) + kAccelBias_m_s2;
  }
  run.imu.insert(run.imu.begin(), run.imu.front());
  run.imu.front().stamp_ns -= ToNanoseconds(0.01);
  const LargestErrors errors = GetErrors(run);
  EXPECT_LT(errors.position_m, 3e-4);
  EXPECT_LT(errors.rotation_rad, 1e-4);
}

}  // namespace
}  // namespace slcmap
