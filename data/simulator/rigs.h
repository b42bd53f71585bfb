// The rigs and IMUs that can be simulated, and rigs that are not as their calibration says.
#pragma once

#include <cstdint>
#include <string>

#include "data/types.h"

namespace slcmap {

// "euroc", "tumvi" (config/rigs) or a file in their form: Kalibr's camera chain with its IMU under
// imu0. Throws ConfigError when there is no such name or file, DataError when the file is absurd.
Rig ReadSimulatedRig(const std::string& name_or_path);

// An IMU by its datasheet: noise, and the spread of its biases at switch-on.
struct ImuModel {
  ImuNoise noise;
  double gyro_bias_rad_s = 0;  // standard deviation of each axis
  double accel_bias_m_s2 = 0;
  bool with_noise = true;
};

// "adis16448" (EuRoC), "bmi160" (TUM VI), "phone" or "perfect" (no noise; told as an adis16448).
// Throws ConfigError naming them.
ImuModel ImuModelFromName(const std::string& name);

// The correction of an IMU that reads 1 + scale times what is there, along axes that are each off by
// axes_deg: in Kalibr's model, the second and third of both sensors out of the right angle, and the
// gyroscope as a whole turned against the accelerometer. Where to is drawn from the seed.
ImuCorrection MisreadingImu(double accel_scale, double gyro_scale, double axes_deg, uint64_t seed);

// A rig that differs from `rig` as a careless calibration does; at scale 1 by standard deviations
// of 0.3 % in focal length, 1.5 px in the principal point, 0.3 degrees and 3 mm in T_imu_camera of
// both cameras alike, and 0.05 degrees and 0.3 mm between the cameras.
Rig Miscalibrated(const Rig& rig, double scale, uint64_t seed);

}  // namespace slcmap
