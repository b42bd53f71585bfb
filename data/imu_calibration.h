// Linear errors of an IMU as calibrations tell them.
#pragma once

#include <string>
#include <vector>

#include "data/types.h"
#include "data/yaml_options.h"

namespace slcmap {

// Reads what a section of an IMU says of scale, axes and turns, in either form:
//
//   Kalibr    accelerometers.M, gyroscopes.M and C_gyro_i:  reading = M C_gyro_i ideal + bias
//   OpenVINS  Ta, R_IMUtoACC, Tw, R_IMUtoGYRO:              reading = T R ideal + bias
//
// (Rehder et al., "Extending kalibr", ICRA 2016; OpenVINS, "IMU Intrinsic Models"; matrices of 3x3
// as rows.) Keys that are not there stand for no error. What it reads and what these forms need
// besides (model) counts as asked for. Throws InputFault, naming file and key, for what is no such
// matrix, and for what is not modelled: a gyroscope that feels forces (A, Tg) and lever arms
// between the axes of an accelerometer (rx_i, ry_i, rz_i), where they are not zero.
ImuCorrection ReadImuCorrection(YamlSection* imu);

bool IsIdentity(const ImuCorrection& correction);

// Kalibr's keys of a correction, indented as those under imu0; "" where it is the identity.
std::string KalibrImuCorrection(const ImuCorrection& correction);

// Samples as an ideal IMU would have read them.
void Correct(const ImuCorrection& correction, std::vector<ImuSample>* samples);

}  // namespace slcmap
