// What was logged beside a video: samples of an IMU, and when frames were taken.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {

struct SensorLog {
  std::vector<ImuRow> samples;  // as they were logged; a half that one lacks is NaN
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
