#include "data/simulator/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "data/core/error.h"
#include "tests/testing/example.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

MotionSpline Flight(double duration_s = 10) {
  return ExampleFlight(ExampleStereoRig(), duration_s);
}

TEST(MotionSpline, DerivativesMatchDifferences) {
  const MotionSpline motion = Flight();
  const double h = 1e-5;
  for (double t = 0.1; t < 9.9; t += 0.0717) {
    const Eigen::Vector3d velocity =
        (motion.PoseAt(t + h).translation - motion.PoseAt(t - h).translation) / (2 * h);
    const Eigen::Vector3d acceleration =
        (motion.VelocityAt(t + h) - motion.VelocityAt(t - h)) / (2 * h);
    EXPECT_LT((velocity - motion.VelocityAt(t)).norm(), 1e-8);
    EXPECT_LT((acceleration - motion.AccelerationAt(t)).norm(), 1e-8);
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
  EXPECT_THROW(MotionSpline(0.1, std::vector<RigidTransform>(5)), DataError);
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
  EXPECT_THROW(FitMotion(Trajectory(1)), DataError);
  trajectory.pop_back();
  EXPECT_THROW(FitMotion(trajectory, {}, Progress([](double) { return false; })), StoppedError);
}

class MadeMotionTest : public ::testing::TestWithParam<MotionKind> {};

TEST_P(MadeMotionTest, LooksAlongTheWayRestsAtItsEndsAndStaysWithinWhatTheKindCanDo) {
  const Rig rig = ExampleStereoRig();
  MadeMotionOptions options;
  options.kind = GetParam();
  options.waypoints_m = {{1, 2, 1.5}, {7, 2, 1.5}, {7, 6, 1.5}, {1, 6, 1.5}, {1, 2, 1.5}};
  const MotionSpline motion = MakeMotion(options, rig);
  const auto camera_at = [&](double t_s) { return motion.PoseAt(t_s) * rig.T_imu_camera[0]; };
  // In the middle of the first side, with the world's up at the top of the image.
  const double t_s = options.stand_still_s + options.ease_s / 2 + 3.0 / options.speed_m_s;
  EXPECT_LT((camera_at(t_s).translation - Eigen::Vector3d(4, 2, 1.5)).norm(), 0.15);
  EXPECT_GT((camera_at(t_s).rotation * Eigen::Vector3d::UnitZ()).x(), 0.98);
  EXPECT_LT((camera_at(t_s).rotation * Eigen::Vector3d::UnitY()).z(), -0.98);
  EXPECT_NEAR(motion.VelocityAt(t_s).x(), options.speed_m_s, 0.25);
  const double end_s = motion.Duration();
  for (const double rest_s : {0.0, 0.5 * options.stand_still_s, end_s - 0.5, end_s}) {
    EXPECT_LT((camera_at(rest_s).translation - Eigen::Vector3d(1, 2, 1.5)).norm(), 1e-3);
    EXPECT_LT(motion.VelocityAt(rest_s).norm(), 0.01);
    EXPECT_LT(motion.AngularVelocityAt(rest_s).norm(), 0.02);
  }
  const RigidTransform change = motion.PoseAt(0).Inverse() * motion.PoseAt(end_s);
  EXPECT_LT(LogRotation(change.rotation).norm(), 3e-3);
  double length_m = 0, most_m_s2 = 0, most_rad_s = 0;
  for (double at_s = 0; at_s < end_s; at_s += 0.01) {
    length_m += 0.01 * motion.VelocityAt(at_s).head<2>().norm();
    most_m_s2 = std::max(most_m_s2, motion.AccelerationAt(at_s).norm());
    most_rad_s = std::max(most_rad_s, motion.AngularVelocityAt(at_s).norm());
  }
  EXPECT_NEAR(length_m, 19.5, 1.0);  // corners are cut a little
  EXPECT_LT(most_m_s2, 6.0);
  EXPECT_GT(most_m_s2, 0.5);
  EXPECT_LT(most_rad_s, 2.5);
  // The seed decides.
  EXPECT_EQ(MakeMotion(options, rig).PoseAt(6.0).translation, motion.PoseAt(6.0).translation);
  options.seed = 2;
  EXPECT_NE(MakeMotion(options, rig).PoseAt(6.0).translation, motion.PoseAt(6.0).translation);
}

INSTANTIATE_TEST_SUITE_P(Kinds, MadeMotionTest,
                         ::testing::Values(MotionKind::kWalk, MotionKind::kRobot,
                                           MotionKind::kFlight));

TEST(MadeMotionOptions, RefusesWhatCannotBeFollowed) {
  for (const char* text : {"{waypoints_m: [[0, 0, 1]]}", "{waypoints_m: [[0, 0], [3, 0]]}",
                           "{waypoints_m: [[0, 0, 1], [3, 0, 1], [1, 0, 1]]}",
                           "{kind: swim, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{speed_m_s: 0, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{speed_m_s: 1e-300, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{seed: -1, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{stand_still_s: 1e9, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{waypoints_m: [[0, 0, 1], [1e7, 0, 1]]}"}) {
    MadeMotionOptions options;
    EXPECT_THROW(options.Read({YAML::Load(text), "scene.yaml: trajectory"}), ConfigError) << text;
  }
}

TEST(MakeMotion, RefusesAWayOfDaysNamingItsLengthAndCanBeEnded) {
  MadeMotionOptions options;
  options.waypoints_m = {{0, 0, 1}, {900, 0, 1}};
  EXPECT_THROW(MakeMotion(options, ExampleStereoRig(), Progress([](double) { return false; })),
               StoppedError);
  options.speed_m_s = 0.01;
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { MakeMotion(options, ExampleStereoRig()); }),
              ::testing::HasSubstr("a way of 900 m that lasts 90006 s"));
}

TEST(SimulateImu, ExactSamplesIntegrateToTheMotion) {
  const MotionSpline motion = Flight(5);
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

TEST(SimulateImu, NoiseHasItsDensitiesAndBiasesWalk) {
  const MotionSpline motion = Flight(200);
  ImuSimulatorOptions options;
  options.initial_gyro_bias_rad_s = {0.01, 0, 0};
  const SimulatedImu noisy = SimulateImu(motion, options);
  options.with_noise = false;
  options.initial_gyro_bias_rad_s.setZero();
  const SimulatedImu exact = SimulateImu(motion, options);
  options.noise.accel_walk_m_s3_sqrthz = -1;
  EXPECT_THROW(SimulateImu(motion, options), ConfigError);
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
  const ImuNoise noise;
  const double scale = 1.0 / (3.0 * static_cast<double>(count)), rate = noise.rate_hz;
  EXPECT_NEAR(std::sqrt(gyro * scale / rate) / noise.gyro_noise_rad_s_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(accel * scale / rate) / noise.accel_noise_m_s2_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(gyro_walk * scale * rate) / noise.gyro_walk_rad_s2_sqrthz, 1, 0.02);
  EXPECT_NEAR(std::sqrt(accel_walk * scale * rate) / noise.accel_walk_m_s3_sqrthz, 1, 0.02);
}

}  // namespace
}  // namespace slcmap
