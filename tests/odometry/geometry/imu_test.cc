#include "odometry/geometry/imu.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "data/simulator/motion.h"
#include "odometry/factors/imu_factor.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

ImuSample Sample(int64_t stamp_ns, double x) {
  ImuSample s;
  s.stamp_ns = stamp_ns;
  s.angular_velocity_rad_s.x() = x;
  return s;
}

TEST(ImuBuffer, RefusesWhatIsNotLaterOrNotFinite) {
  ImuBuffer buffer;
  EXPECT_TRUE(buffer.Add(Sample(10, 1)));
  EXPECT_FALSE(buffer.Add(Sample(10, 1)));
  EXPECT_FALSE(buffer.Add(Sample(5, 1)));
  EXPECT_FALSE(buffer.Add(Sample(20, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(buffer.Add(Sample(20, 1e10)));  // no gyroscope measures this
  EXPECT_TRUE(buffer.Add(Sample(20, 1)));
}

TEST(ImuBuffer, InterpolatesTheEndsOfAnInterval) {
  ImuBuffer buffer;
  for (int i = 0; i <= 10; ++i) buffer.Add(Sample(10 * i, i));
  const auto between = buffer.Between(15, 42);
  ASSERT_EQ(between.size(), 5u);  // 15, 20, 30, 40, 42
  EXPECT_EQ(between.front().stamp_ns, 15);
  EXPECT_DOUBLE_EQ(between.front().angular_velocity_rad_s.x(), 1.5);
  EXPECT_EQ(between.back().stamp_ns, 42);
  EXPECT_DOUBLE_EQ(between.back().angular_velocity_rad_s.x(), 4.2);
  EXPECT_EQ(buffer.Between(20, 40).size(), 3u);
  buffer.DropBefore(55);  // but for what the next interval needs
  EXPECT_DOUBLE_EQ(buffer.Between(55, 60).front().angular_velocity_rad_s.x(), 5.5);
}

TEST(ImuBuffer, FindsTheLongestGap) {
  ImuBuffer buffer;
  for (const int64_t t_ms : {0, 5, 10, 110, 115}) buffer.Add(Sample(t_ms * 1000000, 0));
  EXPECT_NEAR(buffer.LongestGap(0, 115000000), 0.1, 1e-9);
  EXPECT_NEAR(buffer.LongestGap(0, 10000000), 0.005, 1e-9);
  EXPECT_NEAR(buffer.LongestGap(50000000, 60000000), 0.1, 1e-9);  // lies inside the gap
}

struct Flight {
  Rig rig = ExampleStereoRig();
  MotionSpline motion = ExampleFlight(rig, 10);
  SimulatedImu Imu(double rate_hz, bool noisy = false, uint64_t seed = 1) const {
    ImuSimulatorOptions options;
    options.noise = rig.imu_noise;
    options.noise.rate_hz = rate_hz;
    options.with_noise = noisy;
    options.seed = seed;
    return SimulateImu(motion, options);
  }
};

Preintegration Integrate(const std::vector<ImuSample>& samples, const ImuNoise& noise,
                         double from_s, double to_s) {
  Preintegration imu(noise, Vector3d::Zero(), Vector3d::Zero());
  for (const ImuSample& s : samples) {
    if (s.stamp_ns >= ToNanoseconds(from_s) && s.stamp_ns <= ToNanoseconds(to_s)) imu.Append(s);
  }
  return imu;
}

// What the motion says the measurement should be.
Preintegration::Motion Truth(const MotionSpline& motion, double from_s, double to_s) {
  const double t = to_s - from_s;
  const Vector3d gravity(0, 0, -kGravity_m_s2);
  const RigidTransform a = motion.PoseAt(from_s), b = motion.PoseAt(to_s);
  const Eigen::Quaterniond inverse = a.rotation.conjugate();
  return {inverse * Vector3d(b.translation - a.translation - motion.VelocityAt(from_s) * t -
                             0.5 * gravity * t * t),
          inverse * b.rotation,
          inverse * Vector3d(motion.VelocityAt(to_s) - motion.VelocityAt(from_s) - gravity * t)};
}

TEST(Preintegration, ConvergesToTheTrueMotionWithTheRate) {
  const Flight flight;
  double last_error = 0;
  for (const double rate_hz : {200.0, 400.0, 800.0}) {
    const auto measured = Integrate(flight.Imu(rate_hz).samples, flight.rig.imu_noise, 3, 4)
                              .CorrectedFor(Vector3d::Zero(), Vector3d::Zero());
    const auto truth = Truth(flight.motion, 3, 4);
    const double error = (measured.position_m - truth.position_m).norm() +
                         (measured.velocity_m_s - truth.velocity_m_s).norm() +
                         measured.rotation.angularDistance(truth.rotation);
    EXPECT_LT(error, rate_hz == 200 ? 1e-3 : last_error / 3);  // second order in the step
    last_error = error;
  }
}

// The correction is of first order; what is left is of the second.
TEST(Preintegration, CorrectionsMatchIntegratingAgain) {
  const Flight flight;
  const std::vector<ImuSample> samples = flight.Imu(200).samples;
  const ImuErrors errors = 1e-3 * ImuErrors::LinSpaced(-2, 2.5);
  const auto integrated = [&](const Vector3d& bg, const Vector3d& ba, const ImuErrors& of_imu,
                              double most_rad) {
    Preintegration imu = Integrate(samples, flight.rig.imu_noise, 3, 3.5);
    const auto corrected = imu.CorrectedFor(bg, ba, of_imu);
    imu.Repropagate(bg, ba, of_imu);
    const auto again = imu.CorrectedFor(bg, ba, of_imu);
    EXPECT_LT((corrected.position_m - again.position_m).norm(), 2e-5);
    EXPECT_LT((corrected.velocity_m_s - again.velocity_m_s).norm(), 1e-4);
    EXPECT_LT(corrected.rotation.angularDistance(again.rotation), most_rad);
    return again;
  };
  const Vector3d none = Vector3d::Zero();
  integrated({2e-3, -1e-3, 3e-3}, {0.02, -0.03, 0.01}, ImuErrors::Zero(), 2e-6);
  const auto again = integrated(none, none, errors, 1e-5);
  // As samples that were corrected before.
  std::vector<ImuSample> ideal = samples;
  for (ImuSample& sample : ideal) {
    sample.angular_velocity_rad_s = MakeCorrection(errors).gyro * sample.angular_velocity_rad_s;
    sample.specific_force_m_s2 = MakeCorrection(errors).accel * sample.specific_force_m_s2;
  }
  const auto expected = Integrate(ideal, flight.rig.imu_noise, 3, 3.5).CorrectedFor(none, none);
  EXPECT_LT((expected.position_m - again.position_m).norm(), 1e-12);
  EXPECT_LT(expected.rotation.angularDistance(again.rotation), 1e-7);
}

TEST(Preintegration, CovarianceMatchesTheScatterOfNoisyIntegrations) {
  const Flight flight;
  const auto truth = Truth(flight.motion, 3, 3.5);
  const int runs = 200;
  double normalized = 0;
  for (int run = 0; run < runs; ++run) {
    const SimulatedImu noisy = flight.Imu(200, true, 100 + run);
    const size_t first = 600;  // at 3 s
    Preintegration imu(flight.rig.imu_noise, noisy.biases[first].gyro_rad_s,
                       noisy.biases[first].accel_m_s2);
    for (size_t i = first; i <= first + 100; ++i) imu.Append(noisy.samples[i]);
    const auto measured = imu.CorrectedFor(imu.gyro_bias_rad_s(), imu.accel_bias_m_s2());
    Eigen::Matrix<double, 9, 1> error;
    error << measured.position_m - truth.position_m,
        2 * (truth.rotation.conjugate() * measured.rotation).vec(),
        measured.velocity_m_s - truth.velocity_m_s;
    const Eigen::Matrix<double, 9, 9> covariance = imu.covariance().topLeftCorner<9, 9>();
    normalized += error.dot(covariance.ldlt().solve(error)) / runs;
  }
  // Expected 9; the mean of 200 has a standard deviation of sqrt(2 * 9 / 200) = 0.3.
  EXPECT_NEAR(normalized, 9, 1.5);
}

TEST(Preintegration, ARestThatIsCutChangesNothingButTheBiasWalk) {
  // Half a second of turning, then ten at rest.
  ImuNoise noise;
  const auto integrate = [&](int rest_samples) {
    Preintegration imu(noise, Vector3d::Zero(), Vector3d::Zero());
    for (int64_t i = 0; i <= 100 + rest_samples; ++i) {
      const double rate_rad_s =
          i < 100 ? 0.5 * std::sin(static_cast<double>(i) * std::numbers::pi / 100) : 0;
      imu.Append({i * 5'000'000, {rate_rad_s, 0, 0}, {0, 0, i < 100 ? 1.0 : 0.0}});
    }
    return imu;
  };
  Preintegration cut = integrate(2000);
  cut.CutRest(ToNanoseconds(1), ToNanoseconds(9));
  EXPECT_EQ(cut.samples().size(), 101u + 2000 - 1600);
  EXPECT_EQ(cut.samples().back().stamp_ns, ToNanoseconds(10.5));
  EXPECT_EQ(cut.samples().front().stamp_ns, ToNanoseconds(8));
  EXPECT_NEAR(cut.duration_s(), 2.5, 1e-9);
  const Preintegration whole = integrate(2000), without = integrate(400);
  const auto motion = [](const Preintegration& imu) {
    return imu.CorrectedFor(Vector3d::Zero(), Vector3d::Zero());
  };
  EXPECT_LT(motion(cut).rotation.angularDistance(motion(whole).rotation), 1e-12);
  EXPECT_LT((motion(cut).velocity_m_s - motion(whole).velocity_m_s).norm(), 1e-12);
  EXPECT_LT((motion(cut).position_m - motion(without).position_m).norm(), 1e-12);
  for (const int row : {kRowGyroBias, kRowAccelBias}) {
    EXPECT_NEAR(cut.covariance()(row, row) / whole.covariance()(row, row), 1, 1e-9);
  }
}

}  // namespace
}  // namespace slcmap
