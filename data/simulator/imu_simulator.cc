#include "data/simulator/imu_simulator.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr int64_t kMaxSamples = 4'000'000;  // of 4 hours at 277 Hz; 0.5 GB

class NormalVectors {
 public:
  explicit NormalVectors(uint64_t seed) : generator_(seed) {}

  Eigen::Vector3d Draw(double sigma) {
    Eigen::Vector3d v;
    for (int k = 0; k < 3; ++k) v[k] = sigma * normal_(generator_);
    return v;
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

ImuSample ExactSample(const MotionSpline& motion, double t_s) {
  const Eigen::Vector3d up_m_s2(0, 0, kGravity_m_s2);
  const Eigen::Quaterniond R_imu_world = motion.PoseAt(t_s).rotation.conjugate();
  return {0, motion.AngularVelocityAt(t_s), R_imu_world * (motion.AccelerationAt(t_s) + up_m_s2)};
}

}  // namespace

void ImuSimulatorOptions::Check() const {
  if (!(noise.rate_hz > 0)) throw ConfigError("IMU rate_hz: expected a positive number");
  const double least = std::min({noise.gyro_noise_rad_s_sqrthz, noise.gyro_walk_rad_s2_sqrthz,
                                 noise.accel_noise_m_s2_sqrthz, noise.accel_walk_m_s3_sqrthz});
  if (!(least >= 0)) throw ConfigError("IMU noise: expected densities of zero or more");
}

SimulatedImu SimulateImu(const MotionSpline& motion, const ImuSimulatorOptions& options,
                         const Progress& progress) {
  options.Check();
  const double scale = options.with_noise ? 1.0 : 0.0;
  const double root_rate = std::sqrt(options.noise.rate_hz);
  NormalVectors normal(options.seed);
  ImuBias bias{options.initial_gyro_bias_rad_s, options.initial_accel_bias_m_s2};
  SimulatedImu imu;
  const auto count = static_cast<int64_t>(motion.Duration() * options.noise.rate_hz + 1e-6) + 1;
  if (count > kMaxSamples) {
    throw ConfigError(
        fmt::format("IMU: found {} samples to simulate, expected at most {}: simulate "
                    "a shorter time, or a lower rate",
                    count, kMaxSamples));
  }
  for (int64_t i = 0; i < count; ++i) {
    if (i % 1024 == 0) progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(count));
    const double t_s = static_cast<double>(i) / options.noise.rate_hz;
    ImuSample sample = ExactSample(motion, t_s);
    sample.stamp_ns = options.start_stamp_ns + ToNanoseconds(t_s);
    sample.angular_velocity_rad_s +=
        bias.gyro_rad_s + normal.Draw(scale * options.noise.gyro_noise_rad_s_sqrthz * root_rate);
    sample.specific_force_m_s2 +=
        bias.accel_m_s2 + normal.Draw(scale * options.noise.accel_noise_m_s2_sqrthz * root_rate);
    imu.samples.push_back(sample);
    imu.biases.push_back(bias);
    bias.gyro_rad_s += normal.Draw(scale * options.noise.gyro_walk_rad_s2_sqrthz / root_rate);
    bias.accel_m_s2 += normal.Draw(scale * options.noise.accel_walk_m_s3_sqrthz / root_rate);
  }
  return imu;
}

}  // namespace slcmap
