// What was logged beside a video: samples of an IMU, and when frames were taken.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline data {

// A sample, or the half of it that one sensor gives.
struct SensorSample {
  int64_t stamp_ns = 0;
  std::optional<Eigen::Vector3d> gyro_rad_s, accel_m_s2;
};

struct SensorLog {
  std::vector<SensorSample> samples;              // by their stamps
  std::map<int, std::vector<int64_t>> frames_ns;  // by camera, in the order of its video's frames
};

// Reads .jsonl as Spectacular AI's recorder writes it, or .csv: a header that names a time and x, y
// and z of a gyroscope, an accelerometer or both; without one, time, wx, wy, wz, ax, ay, az, or
// four columns of the sensor that the file's name says. Stamps are in s, ms, us or ns, told by how
// far they are apart. Rows that cannot be read are counted. Throws DataError and InputFault.
SensorLog ReadSensorLog(const std::string& path, Warnings* warnings);

// Reads when the frames of a video were taken: a column that a header calls time or stamp, else the
// first one; units as above.
std::vector<int64_t> ReadFrameTimes(const std::string& path, Warnings* warnings);

}  // namespace slcmap::data
