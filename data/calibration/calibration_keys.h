// Values that calibrations of any form must have, read with their file and key in every error.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <Eigen/Core>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"
#include "data/core/rigid_transform.h"
#include "data/core/types.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {

// All of them throw InputFault, or ConfigError of a wrong type, which AsDataErrors turns into one.

template <typename T>
T RequiredValue(YamlSection& section, const std::string& key) {
  if (!section.Has(key)) {
    throw CalibrationFault(section, key, "missing, expected in a calibration",
                           "add " + KeyInFile(section.place(), key));
  }
  T value{};
  section.Read(key, &value);
  return value;
}

std::vector<double> RequiredNumbers(YamlSection& section, const std::string& key, size_t count);

// Width and height as [w, h].
cv::Size RequiredResolution(YamlSection& section);

// Numbers of a matrix as {rows, cols, data}, as ASL and OpenCV write it.
std::vector<double> RequiredMatrix(YamlSection& section, const std::string& key, int rows,
                                   int cols);

// A 4x4 matrix as rows (Kalibr) or as {rows, cols, data}.
RigidTransform RequiredTransform(YamlSection& section, const std::string& key, bool as_data,
                                 Mirrored mirrored);

// Four Kalibr keys, and the rate where it is there.
void ReadNoise(YamlSection& section, const std::string& rate_key, ImuNoise* noise);

// Wrong types are the data's fault here, not the command line's.
InputFault AsInputFault(const ConfigError& error);
template <typename Reader>
auto AsDataErrors(Reader read) {
  try {
    return read();
  } catch (const ConfigError& error) {
    throw AsInputFault(error);
  }
}

}  // namespace slcmap::data
