#include <gtest/gtest.h>

#include "data/simulator/motion.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/imu_factor.h"
#include "tests/odometry/residuals/factor_test_utils.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

Preintegration SomePreintegration() {
  Preintegration imu(ImuNoise(), {0.01, -0.02, 0.03}, {0.1, 0.05, -0.1});
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.005 * i;
    ImuSample s;
    s.stamp_ns = ToNanoseconds(t);
    s.angular_velocity_rad_s << std::sin(3 * t), 0.8 * std::cos(2 * t), 0.4 + t;
    s.specific_force_m_s2 << 1 + t, std::cos(5 * t), 9.5;
    imu.Append(s);
  }
  return imu;
}

std::vector<double> SomeCalibration() {
  return {0.04,   -0.07, 0.05,  0.03, -0.02, 0.05,  0.02,   0.02,  -0.01,  0.015, 0.004,
          -0.003, 0.006, -0.02, 0.01, 0.03,  0.002, -0.004, 0.005, -0.001, 0.003, -0.006};
}

TEST(ImuResidual, JacobiansMatchDifferences) {
  const Preintegration imu = SomePreintegration();
  const ImuResidual factor(&imu, {7'000'000, {0.3, 0.8, -0.4}}, {-4'000'000, {-0.2, 0.5, 0.9}});
  const std::vector<std::vector<double>> blocks = {
      PoseBlockOf({ExpRotation({0.3, -0.2, 1.0}), {1, 2, 3}}),
      {0.5, -1, 0.2, 0.012, -0.018, 0.031, 0.11, 0.04, -0.12},
      PoseBlockOf({ExpRotation({0.35, -0.1, 1.1}), {1.1, 1.8, 3.05}}),
      {0.6, -0.9, 0.1, 0.013, -0.019, 0.032, 0.12, 0.03, -0.13},
      SomeCalibration()};
  ExpectJacobiansMatchDifferences(factor, blocks, 2e-5);
}

// A body that turns and moves steadily, whose IMU has its own place and clock.
TEST(ImuResidual, TheImuAtTheCutIsWhereTheCalibrationPutsIt) {
  const std::vector<double> some = SomeCalibration();
  const double* calibration = some.data();
  const double speed_bias[] = {0.5, -1, 0.2, 0.012, -0.018, 0.031, 0, 0, 0};
  const ImuCut cut{7'000'000, {0.3, 0.8, -0.4}};
  const RigidTransform body{ExpRotation({0.3, -0.2, 1.0}), {1, 2, 3}};
  const RigidTransform imu = ImuAtCut(body, speed_bias, calibration, cut);
  const RigidTransform back = BodyAtExposure(imu, speed_bias, calibration, cut);
  EXPECT_LT((back.translation - body.translation).norm(), 1e-12);
  EXPECT_LT(LogRotation(back.rotation.conjugate() * body.rotation).norm(), 1e-12);
  // The exposure is 13 ms after the cut.
  const RigidTransform at_exposure = body * BodyFromImu(calibration);
  EXPECT_LT(
      (at_exposure.translation - 0.013 * Eigen::Vector3d(0.5, -1, 0.2) - imu.translation).norm(),
      1e-12);
  EXPECT_LT((LogRotation(imu.rotation.conjugate() * at_exposure.rotation) -
             0.013 * Eigen::Vector3d(0.288, 0.818, -0.431))
                .norm(),
            1e-12);
}

TEST(ZeroVelocityResidual, JacobianMatchesDifferences) {
  ExpectJacobiansMatchDifferences(ZeroVelocityResidual(0.02), {{1, 2, 3, 4, 5, 6, 7, 8, 9}}, 1e-6);
}

}  // namespace
}  // namespace slcmap
