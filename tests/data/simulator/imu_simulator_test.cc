#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"
#include "data/simulator/motion.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

MotionSpline FlightFor(double duration_s) { return ExampleFlight(ExampleStereoRig(), duration_s); }

TEST(SimulateImu, ExactSamplesIntegrateToTheMotion) {
  const MotionSpline motion = FlightFor(5.0);
  ImuSimulatorOptions options;
  options.with_noise = false;
  options.noise.rate_hz = 10000;
  const SimulatedImu imu = SimulateImu(motion, options);
  RigidTransform pose = motion.PoseAt(0);
  Eigen::Vector3d velocity = motion.VelocityAt(0);
  for (size_t i = 0; i + 1 < imu.samples.size(); ++i) {
    const ImuSample& a = imu.samples[i];
    const ImuSample& b = imu.samples[i + 1];
    const double dt = ToSeconds(b.stamp_ns - a.stamp_ns);
    const Eigen::Quaterniond turn =
        ExpRotation(0.5 * dt * (a.angular_velocity_rad_s + b.angular_velocity_rad_s));
    const Eigen::Vector3d acceleration =
        0.5 * (pose.rotation * (a.specific_force_m_s2 + turn * b.specific_force_m_s2)) -
        Eigen::Vector3d(0, 0, kGravity_m_s2);
    pose.translation += dt * velocity + 0.5 * dt * dt * acceleration;
    pose.rotation = (pose.rotation * turn).normalized();
    velocity += dt * acceleration;
  }
  const RigidTransform end = motion.PoseAt(5.0);
  EXPECT_LT((pose.translation - end.translation).norm(), 1e-5);
  EXPECT_LT(LogRotation(pose.rotation.conjugate() * end.rotation).norm(), 1e-6);
  EXPECT_LT((velocity - motion.VelocityAt(5.0)).norm(), 1e-5);
}

TEST(SimulateImu, StampsCoverTheMotion) {
  ImuSimulatorOptions options;
  options.start_stamp_ns = 1'403'636'580'838'555'648;
  const SimulatedImu imu = SimulateImu(FlightFor(2.0), options);
  ASSERT_EQ(imu.samples.size(), 401u);
  EXPECT_EQ(imu.samples.front().stamp_ns, options.start_stamp_ns);
  EXPECT_EQ(imu.samples.back().stamp_ns, options.start_stamp_ns + 2'000'000'000);
}

TEST(SimulateImu, NoiseHasItsDensitiesAndBiasesWalk) {
  const MotionSpline motion = FlightFor(200.0);
  ImuSimulatorOptions options;
  options.initial_gyro_bias_rad_s = {0.01, 0, 0};
  const SimulatedImu noisy = SimulateImu(motion, options);
  options.with_noise = false;
  options.initial_gyro_bias_rad_s.setZero();
  const SimulatedImu exact = SimulateImu(motion, options);
  EXPECT_EQ(noisy.biases.front().gyro_rad_s.x(), 0.01);
  double gyro = 0, accel = 0, gyro_walk = 0, accel_walk = 0;
  const size_t count = noisy.samples.size() - 1;
  for (size_t i = 0; i < count; ++i) {
    const ImuSample &n = noisy.samples[i], &e = exact.samples[i];
    const ImuBias &b = noisy.biases[i], &next = noisy.biases[i + 1];
    gyro += (n.angular_velocity_rad_s - e.angular_velocity_rad_s - b.gyro_rad_s).squaredNorm();
    accel += (n.specific_force_m_s2 - e.specific_force_m_s2 - b.accel_m_s2).squaredNorm();
    gyro_walk += (next.gyro_rad_s - b.gyro_rad_s).squaredNorm();
    accel_walk += (next.accel_m_s2 - b.accel_m_s2).squaredNorm();
  }
  const double scale = 1.0 / (3.0 * count), rate = options.noise.rate_hz;
  const ImuNoise& noise = options.noise;
  EXPECT_NEAR(std::sqrt(gyro * scale / rate) / noise.gyro_noise_rad_s_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(accel * scale / rate) / noise.accel_noise_m_s2_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(gyro_walk * scale * rate) / noise.gyro_walk_rad_s2_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(accel_walk * scale * rate) / noise.accel_walk_m_s3_sqrthz, 1, 0.02);
}

TEST(SimulateImu, TheSeedDecides) {
  const MotionSpline motion = FlightFor(1.0);
  ImuSimulatorOptions options;
  const auto last = [&] {
    return SimulateImu(motion, options).samples.back().angular_velocity_rad_s;
  };
  const Eigen::Vector3d first = last();
  EXPECT_EQ(first, last());
  options.seed = 2;
  EXPECT_NE(first, last());
}

TEST(SimulateImu, RefusesNegativeDensities) {
  ImuSimulatorOptions options;
  options.noise.accel_walk_m_s3_sqrthz = -1;
  EXPECT_THROW(SimulateImu(FlightFor(1.0), options), ConfigError);
}

}  // namespace
}  // namespace slcmap
