#include "data/calibration/calibration_keys.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/LU>
#include <cmath>

#include "data/calibration/imu_calibration.h"

namespace slcmap::inline data {
namespace {

[[noreturn]] void FailKey(const YamlSection& section, const std::string& key,
                          const std::string& problem, const std::string& remedy) {
  throw CalibrationFault(section, key, problem, remedy);
}

// Rows or columns of a matrix, where they are said.
void RequireSide(YamlSection& matrix, const char* key, int expected) {
  int count = expected;
  matrix.Read(key, &count);
  if (count == expected) return;
  FailKey(
      matrix, key, fmt::format("found {}, expected {}", count, expected),
      fmt::format("write a matrix of {} {}; correct {}", expected,
                  key == std::string("rows") ? "rows" : "columns", KeyInFile(matrix.place(), key)));
}

}  // namespace

std::vector<double> RequiredNumbers(YamlSection& section, const std::string& key, size_t count) {
  const auto values = RequiredValue<std::vector<double>>(section, key);
  if (values.size() != count) {
    FailKey(section, key, fmt::format("found {} numbers, expected {}", values.size(), count),
            fmt::format("write {} numbers as {}", count, KeyInFile(section.place(), key)));
  }
  return values;
}

cv::Size RequiredResolution(YamlSection& section, const std::string& key) {
  return ResolutionFrom(RequiredNumbers(section, key, 2), section, key);
}

cv::Size ResolutionFrom(const std::vector<double>& sides_px, const YamlSection& section,
                        const std::string& key) {
  for (const double side_px : sides_px) {
    if (side_px == std::floor(side_px) && std::abs(side_px) < 1e6) continue;
    FailKey(
        section, key, fmt::format("found {}, expected whole numbers of pixels", side_px),
        fmt::format("write width and height of the images as {}", KeyInFile(section.place(), key)));
  }
  return {static_cast<int>(sides_px.at(0)), static_cast<int>(sides_px.at(1))};
}

std::vector<double> RequiredMatrix(YamlSection& section, const std::string& key, int rows,
                                   int cols) {
  YamlSection matrix = section.Section(key);
  RequireSide(matrix, "rows", rows);
  RequireSide(matrix, "cols", cols);
  const auto numbers = RequiredNumbers(matrix, "data", static_cast<size_t>(rows * cols));
  matrix.Skip("dt");  // OpenCV's type of the numbers
  matrix.Finish();
  return numbers;
}

RigidTransform RequiredTransform(YamlSection& section, const std::string& key, bool as_data,
                                 Mirrored mirrored) {
  std::vector<double> flat;
  if (as_data) {
    flat = RequiredMatrix(section, key, 4, 4);
  } else {
    const auto rows = RequiredValue<std::vector<std::vector<double>>>(section, key);
    bool complete = rows.size() == 4;
    for (const auto& row : rows) {
      complete = complete && row.size() == 4;
      flat.insert(flat.end(), row.begin(), row.end());
    }
    if (!complete) {
      FailKey(section, key, fmt::format("found {} rows, expected 4 rows of 4", rows.size()),
              "write 4 rows of 4 numbers as " + KeyInFile(section.place(), key));
    }
  }
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = Eigen::Map<decltype(m)>(flat.data());
  const bool is_mirrored = m.topLeftCorner<3, 3>().determinant() < 0;
  if (is_mirrored && mirrored == Mirrored::kNegated) m.topLeftCorner<3, 3>() *= -1;
  try {
    return RigidTransformFromMatrix(m, section.place() + ": " + key);
  } catch (const DataError& error) {
    const std::string remedy = fmt::format(
        "copy {} from the calibration anew, row by row: a rotation and a translation "
        "in metres, then 0 0 0 1",
        KeyInFile(section.place(), key));
    if (is_mirrored) throw MirroredFault("calibration", error.what(), remedy);
    throw InputFault("calibration", error.what(), remedy);
  }
}

void ReadNoise(YamlSection& section, const NoiseKeys& keys, ImuNoise* noise) {
  const auto check = [&](const char* key, double value, double lowest, double highest,
                         const char* unit) {
    if (value >= lowest && value <= highest) return;
    FailKey(section, key,
            fmt::format("found {}, expected {} to {} {}", value, lowest, highest, unit),
            fmt::format("write {} in {}", KeyInFile(section.place(), key), unit));
  };
  noise->gyro_noise_rad_s_sqrthz = RequiredValue<double>(section, keys.gyro_noise);
  noise->gyro_walk_rad_s2_sqrthz = RequiredValue<double>(section, keys.gyro_walk);
  noise->accel_noise_m_s2_sqrthz = RequiredValue<double>(section, keys.accel_noise);
  noise->accel_walk_m_s3_sqrthz = RequiredValue<double>(section, keys.accel_walk);
  section.Read(keys.rate, &noise->rate_hz);
  // Far below the best sensors' on one side, far above the worst's on the other.
  check(keys.gyro_noise, noise->gyro_noise_rad_s_sqrthz, 1e-7, 1, "rad/s/sqrt(Hz)");
  check(keys.gyro_walk, noise->gyro_walk_rad_s2_sqrthz, 1e-9, 1, "rad/s^2/sqrt(Hz)");
  check(keys.accel_noise, noise->accel_noise_m_s2_sqrthz, 1e-6, 10, "m/s^2/sqrt(Hz)");
  check(keys.accel_walk, noise->accel_walk_m_s3_sqrthz, 1e-8, 10, "m/s^3/sqrt(Hz)");
  check(keys.rate, noise->rate_hz, 1, 1e5, "Hz");
}

Camera RequiredCamera(const CameraWords& words, const cv::Size& size_px, const std::string& place) {
  CameraFault fault;
  std::optional<Camera> camera = GetCamera(words, &fault);
  if (!camera) {
    throw InputFault(
        "calibration",
        fmt::format("{}: {}: found {}, expected {}", place, fault.key, fault.found, fault.expected),
        fmt::format("write {} as the {} of {}", fault.expected, fault.key, place));
  }
  camera->width_px = size_px.width;
  camera->height_px = size_px.height;
  camera->Check(place);
  return *camera;
}

InputFault AsInputFault(const ConfigError& error) {
  const std::string what = error.what();
  if (const size_t unknown = what.find(": unknown key"); unknown != std::string::npos) {
    const std::string key = what.substr(0, unknown);
    const bool is_mask = key.find("mask", key.rfind(':') + 1) != std::string::npos;
    return {
        "calibration", what,
        (is_mask ? "give masks as --mask LEFT,RIGHT, and remove " : "correct or remove ") + key};
  }
  const size_t unreadable = what.find(": cannot be");
  return {"calibration", what,
          unreadable != std::string::npos
              ? "write " + what.substr(0, unreadable) + ", for all to read"
              : "correct " + what.substr(0, what.find(": found"))};
}

namespace {

constexpr char kTimeShift[] = "timeshift_cam_imu";
constexpr double kSameShift_s = 1e-6;  // of the two cameras

}  // namespace

double ReadReadout(YamlSection& camera) {
  constexpr double kMaxReadout_s = 0.1;
  double readout_s = 0;
  camera.Read(kReadoutKey, &readout_s);
  if (std::abs(readout_s) <= kMaxReadout_s) return readout_s;
  throw CalibrationFault(
      camera, kReadoutKey,
      fmt::format("found {} s, expected at most {} s either way", readout_s, kMaxReadout_s),
      fmt::format("write {} in seconds from the first row to the last",
                  KeyInFile(camera.place(), kReadoutKey)));
}

void ReadTimes(YamlSection* section, ChainCamera* camera) {
  if (section->Has(kTimeShift)) {
    section->Read(kTimeShift, &camera->time_shift_s.emplace());
  }
  camera->readout_s = ReadReadout(*section);
}

void TakeTimes(const std::vector<const ChainCamera*>& used, Rig* rig, Warnings* warnings) {
  for (size_t i = 0; i < used.size(); ++i) rig->readout_s[i] = used[i]->readout_s;
  const double first_s = rig->camera_time_offset_s = used[0]->time_shift_s.value_or(0);
  for (size_t i = 1; i < used.size(); ++i) {
    const double later_s = used[i]->time_shift_s.value_or(first_s) - first_s;
    if (!(std::abs(later_s) <= kMaxRightOffset_s)) {
      throw InputFault(
          "calibration",
          fmt::format("{}: {}: found {} s, expected that of cam{}, {} s, to {} s", used[i]->place,
                      kTimeShift, first_s + later_s, used[0]->index, first_s, kMaxRightOffset_s),
          fmt::format("trigger the cameras together, or bring the stamps of cam{} to the clock of "
                      "cam{}, and write the latter's shift as {}",
                      used[i]->index, used[0]->index, KeyInFile(used[i]->place, kTimeShift)));
    }
    const bool is_apart = std::abs(later_s) > kMinRightOffset_s;
    if (i == 1) rig->right_time_offset_s = is_apart ? later_s : 0;
    if (i > 1) rig->other_time_offsets_s.push_back(is_apart ? later_s : 0);
    if (!is_apart && std::abs(later_s) > kSameShift_s) {
      warnings->Add(kTimeShiftsDiffer, used[i]->place);
    }
  }
}

}  // namespace slcmap::data
