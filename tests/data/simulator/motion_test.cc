#include "data/simulator/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

MotionSpline Flight() { return ExampleFlight(ExampleStereoRig(), 10.0); }

TEST(MotionSpline, LinearDerivativesMatchDifferences) {
  const MotionSpline motion = Flight();
  const double h = 1e-5;
  for (double t = 0.1; t < 9.9; t += 0.0717) {
    const Eigen::Vector3d velocity =
        (motion.PoseAt(t + h).translation - motion.PoseAt(t - h).translation) / (2 * h);
    const Eigen::Vector3d acceleration =
        (motion.VelocityAt(t + h) - motion.VelocityAt(t - h)) / (2 * h);
    EXPECT_LT((velocity - motion.VelocityAt(t)).norm(), 1e-8);
    EXPECT_LT((acceleration - motion.AccelerationAt(t)).norm(), 1e-8);
  }
}

TEST(MotionSpline, AngularVelocityMatchesDifferences) {
  const MotionSpline motion = Flight();
  const double h = 1e-5;
  for (double t = 0.1; t < 9.9; t += 0.0717) {
    const Eigen::Vector3d turn =
        LogRotation(motion.PoseAt(t - h).rotation.conjugate() * motion.PoseAt(t + h).rotation);
    EXPECT_LT((turn / (2 * h) - motion.AngularVelocityAt(t)).norm(), 1e-8);
  }
}

TEST(MotionSpline, IsSmoothAcrossKnots) {
  const MotionSpline motion = Flight();
  const double h = 1e-9, step_s = 1e-5;
  for (double t = 0.1; t < 9.9; t += 0.1) {
    EXPECT_LT((motion.AccelerationAt(t + h) - motion.AccelerationAt(t - h)).norm(), 1e-6);
    const Eigen::Vector3d before =
        motion.AngularVelocityAt(t) - motion.AngularVelocityAt(t - step_s);
    const Eigen::Vector3d after =
        motion.AngularVelocityAt(t + step_s) - motion.AngularVelocityAt(t);
    EXPECT_LT((after - before).norm() / step_s, 0.02);
  }
}

TEST(MotionSpline, RestsWhereTheControlPosesAreTheSame) {
  const MotionSpline motion = ExampleFlight(ExampleStereoRig(), 5.0, 2.0);
  EXPECT_NEAR(motion.Duration(), 5.0, 1e-9);
  EXPECT_LT(motion.AccelerationAt(1.0).norm(), 1e-9);
  EXPECT_LT(motion.AngularVelocityAt(1.0).norm(), 1e-9);
  EXPECT_GT(motion.VelocityAt(4.5).norm(), 0.5);
}

TEST(MotionSpline, ASliceIsTheSameMotion) {
  const MotionSpline motion = Flight();
  const MotionSpline slice = motion.Slice(1.0, 8.0).Slice(1.03, 3.05);
  EXPECT_NEAR(slice.Duration(), 3.05, 1e-9);
  for (double t = 0; t < 3.05; t += 0.1371) {
    EXPECT_LT((slice.PoseAt(t).translation - motion.PoseAt(2.03 + t).translation).norm(), 1e-9);
    EXPECT_LT((slice.AngularVelocityAt(t) - motion.AngularVelocityAt(2.03 + t)).norm(), 1e-9);
  }
  EXPECT_NEAR(motion.Slice(9.0, 1e6).Duration(), 1.0, 1e-9);
  EXPECT_THROW(motion.Slice(10.0, 1.0), DataError);
}

TEST(MotionSpline, RefusesTooFewControlPoses) {
  EXPECT_THROW(MotionSpline(0.1, std::vector<RigidTransform>(5)), DataError);
}

TEST(CameraLookingAlong, HasTheWorldsUpAtItsTop) {
  const Eigen::Matrix3d R = CameraLookingAlong({1, 1, 0.3}).toRotationMatrix();
  EXPECT_NEAR(R.determinant(), 1, 1e-12);
  EXPECT_LT((R.col(2) - Eigen::Vector3d(1, 1, 0.3).normalized()).norm(), 1e-12);
  EXPECT_NEAR(R(2, 0), 0, 1e-12);
  EXPECT_LT(R(2, 1), -0.9);
}

Trajectory Sampled(const MotionSpline& motion, double rate_hz) {
  Trajectory trajectory;
  for (int i = 0; i / rate_hz <= motion.Duration(); ++i) {
    trajectory.push_back({1'000'000'000 + ToNanoseconds(i / rate_hz), motion.PoseAt(i / rate_hz)});
  }
  return trajectory;
}

TEST(FitMotion, ReturnsTheMotionThatWasSampled) {
  const MotionSpline truth = Flight();
  MotionFitOptions options;
  options.smoothing = 1e-9;
  const MotionFit fit = FitMotion(Sampled(truth, 200), options);
  EXPECT_LT(fit.position_max_m, 1e-6);
  EXPECT_LT(fit.rotation_max_rad, 1e-6);
  for (double t = 0.05; t < 9.95; t += 0.0931) {
    EXPECT_LT((fit.motion.AccelerationAt(t) - truth.AccelerationAt(t)).norm(), 1e-3);
    EXPECT_LT((fit.motion.AngularVelocityAt(t) - truth.AngularVelocityAt(t)).norm(), 1e-4);
  }
}

TEST(FitMotion, KeepsJitterOutOfTheAccelerationAndBridgesGaps) {
  const MotionSpline truth = Flight();
  Trajectory jittery = Sampled(truth, 200);
  for (size_t i = 0; i < jittery.size(); ++i) {
    jittery[i].T_world_imu.translation.x() += i % 2 == 0 ? 0.001 : -0.001;
  }
  jittery.erase(jittery.begin() + 1000, jittery.begin() + 1080);  // 0.4 s
  const MotionFit fit = FitMotion(jittery);
  EXPECT_NEAR(fit.position_rms_m, 0.001, 2e-4);
  for (double t = 0.2; t < 9.8; t += 0.05) {
    EXPECT_LT((fit.motion.PoseAt(t).translation - truth.PoseAt(t).translation).norm(), 3e-3) << t;
    EXPECT_LT((fit.motion.AccelerationAt(t) - truth.AccelerationAt(t)).norm(), 0.5) << t;
  }
}

TEST(FitMotion, RefusesDaysAndCanBeEnded) {
  Trajectory trajectory(3);
  trajectory[1].stamp_ns = ToNanoseconds(1);
  trajectory[2].stamp_ns = ToNanoseconds(1e6);
  EXPECT_THROW(FitMotion(trajectory), DataError);
  trajectory.pop_back();
  EXPECT_THROW(FitMotion(trajectory, {}, Progress([](double) { return false; })), StoppedError);
}

TEST(FitMotion, RefusesOnePose) { EXPECT_THROW(FitMotion(Trajectory(1)), DataError); }

}  // namespace
}  // namespace slcmap
