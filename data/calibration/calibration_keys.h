// Values that calibrations of any form must have, read with their file and key in every error; when
// the images of calibrated cameras are exposed: by how much their stamps are shifted against the
// IMU's and each other's, and how long a rolling shutter takes.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/calibration/camera_words.h"
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

// Width and height as [w, h]; and of numbers that a key has.
cv::Size RequiredResolution(YamlSection& section, const std::string& key = "resolution");
cv::Size ResolutionFrom(const std::vector<double>& sides_px, const YamlSection& section,
                        const std::string& key);

// Numbers of a matrix as {rows, cols, data}, as ASL and OpenCV write it.
std::vector<double> RequiredMatrix(YamlSection& section, const std::string& key, int rows,
                                   int cols);

// A 4x4 matrix as rows (Kalibr) or as {rows, cols, data}.
RigidTransform RequiredTransform(YamlSection& section, const std::string& key, bool as_data,
                                 Mirrored mirrored);

// What a form calls the noise of an IMU: Kalibr's names.
struct NoiseKeys {
  const char* gyro_noise = "gyroscope_noise_density";
  const char* gyro_walk = "gyroscope_random_walk";
  const char* accel_noise = "accelerometer_noise_density";
  const char* accel_walk = "accelerometer_random_walk";
  const char* rate = "update_rate";  // may be absent
};
void ReadNoise(YamlSection& section, const NoiseKeys& keys, ImuNoise* noise);

// The camera of such words; `place` stands in the fault.
Camera RequiredCamera(const CameraWords& words, const cv::Size& size_px, const std::string& place);

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

// Between the images of a pair: what is further apart in time is taken for a mistake.
inline constexpr double kMaxRightOffset_s = 0.03;
inline constexpr double kMinRightOffset_s = 1e-3;  // less is how stamps and calibrations scatter

// Of a camera, in ASL's and in Kalibr's form: Rig::readout_s.
inline constexpr const char* kReadoutKey = "readout_s";

// Of a camera; 0 where it is not said. Throws InputFault for one that cannot be.
double ReadReadout(YamlSection& camera);

// What a camera's section says of its times. Throws InputFault for a readout that cannot be.
void ReadTimes(YamlSection* section, ChainCamera* camera);

// The times of a rig of the cameras that are used. A camera without a shift has that of the rig:
// none, or that of the left one. Throws InputFault where shifts are too far apart.
void TakeTimes(const std::vector<const ChainCamera*>& used, Rig* rig, Warnings* warnings);

}  // namespace slcmap::data
