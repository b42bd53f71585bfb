// Linear errors of an IMU as calibrations tell them; and a key of a calibration that cannot be
// used, said with its file and a remedy.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {

// "a.yaml: cam0" and "intrinsics" -> "cam0.intrinsics in a.yaml", for remedies.
inline std::string KeyInFile(const std::string& place, const std::string& key) {
  const size_t colon = place.find(": ");
  if (colon == std::string::npos) return key + " in " + place;
  return place.substr(colon + 2) + "." + key + " in " + place.substr(0, colon);
}

// "a.yaml: cam0: intrinsics: PROBLEM", to throw.
inline InputFault CalibrationFault(const YamlSection& section, const std::string& key,
                                   const std::string& problem, const std::string& remedy) {
  return InputFault("calibration", fmt::format("{}: {}: {}", section.place(), key, problem),
                    remedy);
}

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

}  // namespace slcmap::data
