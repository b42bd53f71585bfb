// What an IMU measures along a motion.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/progress.h"
#include "data/simulator/motion.h"
#include "data/types.h"

namespace slcmap {

struct ImuSimulatorOptions {
  ImuNoise noise;
  bool with_noise = true;  // false: exact values; the initial biases below still hold, and stay
  Eigen::Vector3d initial_gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d initial_accel_bias_m_s2 = Eigen::Vector3d::Zero();
  int64_t start_stamp_ns = 0;  // of the motion's time 0
  uint64_t seed = 1;
  void Check() const;  // throws ConfigError
};

struct ImuBias {
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

struct SimulatedImu {
  std::vector<ImuSample> samples;
  std::vector<ImuBias> biases;  // the true one at each sample
};

// Samples at the rate of the noise model over the whole motion. Each is the value at the instant of
// its stamp, plus its bias, plus white noise of density * sqrt(rate); biases walk by density /
// sqrt(rate) from one sample to the next (Kalibr's discrete model).
// Throws ConfigError where these are more than some hours give, and StoppedError where progress
// ends it.
SimulatedImu SimulateImu(const MotionSpline& motion, const ImuSimulatorOptions& options,
                         const Progress& progress = {});

}  // namespace slcmap
