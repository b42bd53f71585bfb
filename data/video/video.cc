#include "data/video/video.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/io/json.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

struct SensorLog {
  std::vector<ImuRow> samples;  // as they were logged; a half that one lacks is NaN
  std::map<int, std::vector<int64_t>> frames_ns;  // by camera, in the order of its video's frames
};

// What a step between stamps may be; in another unit it is a thousand times off.
constexpr double kMostSampleStep_s = 0.05, kMostFrameStep_s = 0.7;
constexpr double kOfAll = 200;  // the least step is so much shorter

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

bool HasWord(const std::string& text, std::initializer_list<const char*> words) {
  return std::ranges::any_of(
      words, [&](const char* word) { return text.find(word) != std::string::npos; });
}

bool NamesTime(const std::string& name) { return name == "t" || HasWord(name, {"time", "stamp"}); }
// Of other sensors, and what phones make of them.
bool NamesOther(const std::string& name) {
  return HasWord(name, {"mag", "lin", "user", "grav", "bias", "angle", "quat"});
}
bool NamesGyro(const std::string& name) {
  if (NamesOther(name)) return false;
  return HasWord(name, {"gyr", "omega", "angular", "rotationrate", "rotation_rate"}) ||
         name.starts_with("w") || name.starts_with("gx") || name.starts_with("gy") ||
         name.starts_with("gz");
}
bool NamesAccel(const std::string& name) {
  if (NamesOther(name)) return false;
  return HasWord(name, {"acc"}) || name.starts_with("a_") || name.starts_with("ax") ||
         name.starts_with("ay") || name.starts_with("az");
}

// 0 to 2 of a name whose last word but for units ends in x, y or z, such as acc_x_m_s2 or
// gyroX(rad/s); -1 of others.
int AxisIn(const std::string& name) {
  static constexpr std::string_view kUnits[] = {"m", "s", "s2", "ms2", "mss", "rad", "deg", "g"};
  int axis = -1;
  std::string word;
  for (const char c : name.substr(0, name.find_first_of("[(")) + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
      continue;
    }
    const bool is_unit = word.empty() || std::ranges::count(kUnits, word) > 0;
    if (!is_unit) axis = word.back() >= 'x' && word.back() <= 'z' ? word.back() - 'x' : -1;
    word.clear();
  }
  return axis;
}

// Which columns hold what; -1: none.
struct Columns {
  int time = 0;
  std::array<int, 3> gyro = {-1, -1, -1}, accel = {-1, -1, -1};
};

bool IsWhole(const std::array<int, 3>& columns) {
  return std::ranges::all_of(columns, [](int column) { return column >= 0; });
}

[[noreturn]] void FailColumns(const std::string& path, const std::string& found) {
  throw InputFault("imu-columns",
                   fmt::format("{}: found {}, expected a time, and x, y and z of a gyroscope or an "
                               "accelerometer once",
                               path, found),
                   "head the table: time_s, gyro_x, gyro_y, gyro_z, acc_x, acc_y, acc_z");
}

// Which sensor alone the name of a file says.
std::pair<bool, bool> IsOfGyroOrAccel(const std::string& path) {
  const std::string name = Lower(fs::path(path).stem().string());
  const bool of_gyro = HasWord(name, {"gyr"}), of_accel = HasWord(name, {"acc"});
  return {of_gyro && !of_accel, of_accel && !of_gyro};
}

Columns FromHeader(const std::string& path, const std::vector<std::string_view>& names) {
  Columns columns{-1, {-1, -1, -1}, {-1, -1, -1}};
  auto [of_gyro, of_accel] = IsOfGyroOrAccel(path);
  bool is_of_ros = false;
  for (const std::string_view each : names) {
    const std::string name = Lower(each);
    // What an accelerometer reads; phones call it so without gravity.
    is_of_ros = is_of_ros || HasWord(name, {"angular_velocity"});
    const bool is_named = AxisIn(name) >= 0 && (NamesGyro(name) || NamesAccel(name));
    if (is_named && name.size() > 1) of_gyro = of_accel = false;  // the file's name says no more
  }
  const auto take = [&](int column, const std::string& name, int* place) {
    if (*place >= 0) FailColumns(path, "more than one column like '" + name + "'");
    *place = column;
  };
  for (int i = 0; i < std::ssize(names); ++i) {
    const std::string name = Lower(names[static_cast<size_t>(i)]);
    const int axis = AxisIn(name);
    if (NamesTime(name)) {
      if (columns.time < 0) columns.time = i;
    } else if (axis >= 0 && (NamesAccel(name) || (of_accel && name.size() == 1) ||
                             (is_of_ros && HasWord(name, {"linear_acceleration"})))) {
      take(i, name, &columns.accel[static_cast<size_t>(axis)]);
    } else if (axis >= 0 && (NamesGyro(name) || (of_gyro && name.size() == 1))) {
      take(i, name, &columns.gyro[static_cast<size_t>(axis)]);
    }
  }
  return columns;
}

Columns WithoutHeader(const std::string& path, size_t count) {
  const auto [of_gyro, of_accel] = IsOfGyroOrAccel(path);
  if (count == 4 && (of_gyro || of_accel)) {
    Columns columns;
    (of_accel ? columns.accel : columns.gyro) = {1, 2, 3};
    return columns;
  }
  return {0, {1, 2, 3}, {4, 5, 6}};
}

// A table whose stamps wait for their unit.
struct StampedRows {
  std::vector<std::string> stamps;
  std::vector<std::vector<double>> values;
};

// Powers of ten from stamps to nanoseconds, by the median step between them.
int FindStampShift(const std::string& path, const std::vector<std::string>& stamps,
                   double most_step_s) {
  std::vector<double> numbers, steps;
  for (const std::string& stamp : stamps) numbers.push_back(ParseNumber(stamp).value_or(0));
  for (size_t i = 1; i < numbers.size(); ++i)
    steps.push_back(std::abs(numbers[i] - numbers[i - 1]));
  const double step = Median(steps);
  for (const int shift : {9, 6, 3, 0}) {
    const double step_s = step * std::pow(10, shift - 9);
    if (step_s <= most_step_s && step_s > most_step_s / kOfAll) return shift;
  }
  throw InputFault("stamp-units",
                   fmt::format("{}: found stamps {} apart, expected seconds, ms, us or ns of a "
                               "sensor that is read often",
                               path, step),
                   "name the column of the time in the header");
}

std::vector<int64_t> ScaledStamps(const std::string& path, const StampedRows& rows,
                                  double most_step_s) {
  const int shift = FindStampShift(path, rows.stamps, most_step_s);
  std::vector<int64_t> stamps_ns;
  for (const std::string& stamp : rows.stamps) {
    stamps_ns.push_back(ParseScaledInteger(stamp, shift).value_or(0));
  }
  return stamps_ns;
}

// Of the rows that have numbers wherever `columns` says; fills it by the first row.
template <typename FindColumns>
StampedRows ReadStampedRows(const std::string& path, FindColumns find_columns,
                            std::vector<int>* columns, Warnings* warnings) {
  StampedRows rows;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    if (columns->empty()) {
      const bool is_header = !ParseNumber(fields.front());
      *columns = find_columns(is_header, fields);
      if (is_header) return;
    }
    std::vector<double> values;
    for (const int column : *columns) {
      const auto at = static_cast<size_t>(column);
      const auto value = at < fields.size() ? ParseNumber(fields[at]) : std::nullopt;
      if (value && std::isfinite(*value)) values.push_back(*value);
    }
    if (values.size() != columns->size()) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, row));
      return;
    }
    rows.stamps.emplace_back(fields[static_cast<size_t>(columns->front())]);
    rows.values.push_back(std::move(values));
  });
  return rows;
}

// The time first, then the gyroscope's, then the accelerometer's.
std::vector<int> InOneRow(const std::string& path, const Columns& columns) {
  std::vector<int> row = {columns.time};
  for (const std::array<int, 3>& sensor : {columns.gyro, columns.accel}) {
    const bool is_there = std::ranges::any_of(sensor, [](int column) { return column >= 0; });
    if (is_there && !IsWhole(sensor)) FailColumns(path, "a part of the axes of a sensor");
    if (is_there) row.insert(row.end(), sensor.begin(), sensor.end());
  }
  if (columns.time < 0 || row.size() == 1) FailColumns(path, "other columns");
  return row;
}

// Without either half yet.
ImuRow& AddSample(int64_t stamp_ns, SensorLog* log) {
  ImuRow& sample = log->samples.emplace_back();
  sample.stamp_ns = stamp_ns;
  sample.angular_velocity_rad_s.setConstant(std::numeric_limits<double>::quiet_NaN());
  sample.specific_force_m_s2 = sample.angular_velocity_rad_s;
  return sample;
}

SensorLog ReadCsvLog(const std::string& path, Warnings* warnings) {
  std::vector<int> order;
  Columns columns;
  const StampedRows rows = ReadStampedRows(
      path,
      [&](bool is_header, const std::vector<std::string_view>& fields) {
        columns = is_header ? FromHeader(path, fields) : WithoutHeader(path, fields.size());
        return InOneRow(path, columns);
      },
      &order, warnings);
  if (rows.stamps.size() < 2) {
    throw DataError(
        fmt::format("{}: found {} rows of an IMU, expected many", path, rows.stamps.size()));
  }
  const std::vector<int64_t> stamps_ns = ScaledStamps(path, rows, kMostSampleStep_s);
  const bool has_gyro = IsWhole(columns.gyro), has_accel = IsWhole(columns.accel);
  SensorLog log;
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    const double* values = rows.values[i].data() + 1;
    ImuRow& sample = AddSample(stamps_ns[i], &log);
    if (has_gyro) sample.angular_velocity_rad_s = Vector3d::Map(values);
    if (has_accel) sample.specific_force_m_s2 = Vector3d::Map(values + (has_gyro ? 3 : 0));
  }
  return log;
}

int64_t SecondsToStamp(const Json& json) {
  return static_cast<int64_t>(std::llround(json.get<double>() * 1e9));
}

void AddSensor(const Json& entry, SensorLog* log) {
  const Json& sensor = entry.at("sensor");
  const auto type = sensor.at("type").get<std::string>();
  if (type != "gyroscope" && type != "accelerometer") return;
  const auto values = sensor.at("values").get<std::array<double, 3>>();
  ImuRow& sample = AddSample(SecondsToStamp(entry.at("time")), log);
  (type == "gyroscope" ? sample.angular_velocity_rad_s : sample.specific_force_m_s2) =
      Vector3d::Map(values.data());
}

// A frame may have a time of its own, else that of its set.
void AddFrames(const Json& entry, SensorLog* log) {
  for (const Json& frame : entry.at("frames")) {
    const Json& time = frame.contains("time") ? frame.at("time") : entry.at("time");
    log->frames_ns[frame.value("cameraInd", 0)].push_back(SecondsToStamp(time));
  }
}

SensorLog ReadJsonLines(const std::string& path, Warnings* warnings) {
  SensorLog log;
  std::istringstream text(ReadFile(path));
  std::string line;
  for (int row = 1; std::getline(text, line); ++row) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      const Json entry = Json::parse(line);
      if (entry.contains("sensor")) AddSensor(entry, &log);
      if (entry.contains("frames")) AddFrames(entry, &log);
    } catch (const Json::exception&) {
      warnings->Add(kRowUnreadable, fmt::format("{}: row {}", path, row));
    }
  }
  return log;
}

// Reads .jsonl as Spectacular AI's recorder writes it, or .csv: a header that names a time and x, y
// and z of a gyroscope, an accelerometer or both, or x, y and z alone of the sensor that the file's
// name says; without one, time, wx, wy, wz, ax, ay, az, or four columns of that sensor. Stamps are
// in s, ms, us or ns, told by how far they are apart. Rows that cannot be read are counted. Throws
// DataError and InputFault.
SensorLog ReadSensorLog(const std::string& path, Warnings* warnings) {
  return path.ends_with(".jsonl") ? ReadJsonLines(path, warnings) : ReadCsvLog(path, warnings);
}

// Reads when the frames of a video were taken: a column that a header calls time or stamp, else the
// first one; units as above.
std::vector<int64_t> ReadFrameTimes(const std::string& path, Warnings* warnings) {
  std::vector<int> order;
  const StampedRows rows = ReadStampedRows(
      path,
      [&](bool is_header, const std::vector<std::string_view>& fields) {
        return std::vector<int>{is_header ? std::max(0, FromHeader(path, fields).time) : 0};
      },
      &order, warnings);
  if (rows.stamps.size() < 2) {
    throw DataError(fmt::format("{}: found {} times of frames, expected one a frame", path,
                                rows.stamps.size()));
  }
  std::vector<int64_t> stamps_ns = ScaledStamps(path, rows, kMostFrameStep_s);
  if (std::ranges::adjacent_find(stamps_ns, std::greater_equal<>()) != stamps_ns.end()) {
    throw DataError(path + ": found times of frames that do not rise, expected those of a video");
  }
  return stamps_ns;
}

constexpr int64_t kAround_ns = 1'000'000'000;  // of the IMU's time, in which a video may start

// The first of the files that is there.
std::string FindFile(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (fs::is_regular_file(folder / name)) return (folder / name).string();
  }
  return "";
}

std::string ListFiles(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;  // of a folder that is not there
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  constexpr size_t kMost = 20;
  if (names.size() > kMost) names.resize(kMost);
  return fmt::format("{}", fmt::join(names, ", "));
}

[[noreturn]] void FailLog(const std::string& video, const std::string& found) {
  throw InputFault(
      "video-log",
      fmt::format("{}: found {}, expected a log of its IMU; there are {}", video, found,
                  ListFiles(fs::path(video).parent_path())),
      "name the log: --imu walk.csv, twice where gyroscope and accelerometer are apart");
}

SensorLog ReadLogs(const VideoRecording& recording, Warnings* warnings) {
  SensorLog log;
  for (const std::string& path : recording.logs) {
    SensorLog read = ReadSensorLog(path, warnings);
    log.samples.insert(log.samples.end(), read.samples.begin(), read.samples.end());
    log.frames_ns.merge(read.frames_ns);
  }
  std::ranges::stable_sort(log.samples, {}, &ImuRow::stamp_ns);
  const auto has = [&](auto half) {
    return std::ranges::any_of(log.samples,
                               [&](const ImuRow& sample) { return !(sample.*half).hasNaN(); });
  };
  if (!has(&ImuRow::angular_velocity_rad_s) || !has(&ImuRow::specific_force_m_s2)) {
    FailLog(recording.left, "no gyroscope or no accelerometer in " + recording.logs.front());
  }
  return log;
}

// The stamps of a video's frames.
class FrameClock {
 public:
  // `listed`: of the frames, in their order; none: those of the video are taken.
  FrameClock(std::string video, std::vector<int64_t> listed_ns, const SensorLog& log)
      : video_(std::move(video)), listed_ns_(std::move(listed_ns)), log_(log) {}

  // Nothing for a frame that is in no list.
  std::optional<int64_t> FindStamp(int64_t frame, int64_t time_ns) const {
    if (frame == 0) RequireClockOfImu(listed_ns_.empty() ? time_ns : listed_ns_.front());
    if (listed_ns_.empty()) return time_ns;
    if (frame < std::ssize(listed_ns_)) return listed_ns_[static_cast<size_t>(frame)];
    return std::nullopt;
  }

  int64_t FramesMissing(int64_t frames) const {
    return std::max<int64_t>(std::ssize(listed_ns_) - frames, 0);
  }

 private:
  void RequireClockOfImu(int64_t time_ns) const {
    const int64_t first_ns = log_.samples.front().stamp_ns, last_ns = log_.samples.back().stamp_ns;
    if (time_ns >= first_ns - kAround_ns && time_ns <= last_ns) return;
    throw InputFault(
        "video-clock",
        fmt::format("{}: found the first frame at {:.3f} s, expected it on the clock of the IMU, "
                    "from {:.3f} to {:.3f} s",
                    video_, 1e-9 * static_cast<double>(time_ns),
                    1e-9 * static_cast<double>(first_ns), 1e-9 * static_cast<double>(last_ns)),
        "give the times of the frames on that clock: --frame-times frames.csv");
  }

  std::string video_;
  std::vector<int64_t> listed_ns_;
  const SensorLog& log_;
};

// One camera's folder.
class FrameFolder {
 public:
  explicit FrameFolder(const std::string& folder) : folder_(folder) {
    MakeFolder(folder + "/data");
  }

  void Add(int64_t stamp_ns, const cv::Mat& grey) {
    const std::string name = fmt::format("{}.png", stamp_ns);
    WritePng(folder_ + "/data/" + name, grey);
    rows_ += fmt::format("{},{}\n", stamp_ns, name);
    ++count_;
  }

  int64_t Finish() const {
    WriteFile(folder_ + "/data.csv", kAslImagesHead + rows_);
    return count_;
  }

 private:
  std::string folder_, rows_;
  int64_t count_ = 0;
};

void CountFrames(const std::string& video, const FrameClock& clock, int64_t frames,
                 int64_t without_stamp, Warnings* warnings) {
  for (int64_t i = 0; i < without_stamp; ++i) warnings->Add("frames_that_no_list_has", video);
  for (int64_t i = 0; i < clock.FramesMissing(frames); ++i) {
    warnings->Add("listed_frames_that_the_video_has_not", video);
  }
}

// Writes a video into the folder of its camera, or of both whose images lie side by side.
void UnpackFrames(const std::string& video, const FrameClock& clock,
                  const std::vector<FrameFolder*>& folders, const Progress& progress,
                  Warnings* warnings) {
  VideoFile file(video);
  int64_t frames = 0, without_stamp = 0;
  while (const auto frame = file.Next()) {
    const auto stamp_ns = clock.FindStamp(frames++, frame->time_ns);
    without_stamp += stamp_ns ? 0 : 1;
    const int width_px = frame->grey.cols / static_cast<int>(folders.size());
    for (size_t i = 0; stamp_ns && i < folders.size(); ++i) {
      const cv::Rect part(static_cast<int>(i) * width_px, 0, width_px, frame->grey.rows);
      folders[i]->Add(*stamp_ns, frame->grey(part));
    }
    progress.ReportOrStop(file.Done());
  }
  CountFrames(video, clock, frames, without_stamp, warnings);
  warnings->Merge(file.warnings());
}

std::vector<int64_t> ListedFrames(const VideoRecording& recording, const SensorLog& log, int camera,
                                  Warnings* warnings) {
  if (!recording.frame_times.empty()) return ReadFrameTimes(recording.frame_times, warnings);
  const auto listed = log.frames_ns.find(camera);
  return listed == log.frames_ns.end() ? std::vector<int64_t>() : listed->second;
}

std::string ImuRows(const SensorLog& log) {
  std::string rows = kAslImuHead;
  for (const ImuRow& sample : log.samples) rows += AslImuText(sample);
  return rows;
}

}  // namespace

bool IsVideoRecording(const std::string& path) {
  if (!fs::is_directory(path)) return IsVideoName(path) && fs::exists(path);
  constexpr std::array kParts = {"mav0", "cam0", "imu0"};
  const bool is_recording = std::ranges::any_of(
      kParts, [&](const char* part) { return fs::exists(fs::path(path) / part); });
  return !is_recording && !FindFile(path, {"data.mkv", "data.mp4"}).empty();
}

VideoRecording FindVideoRecording(const std::string& path, const VideoRecording& said) {
  VideoRecording found = said;
  found.left = fs::is_directory(path) ? FindFile(path, {"data.mkv", "data.mp4"}) : path;
  const fs::path left = found.left;
  const fs::path folder = left.parent_path();
  if (found.right.empty() && !found.side_by_side && left.stem() == "data") {
    found.right = FindFile(folder, {"data2.mkv", "data2.mp4"});
  }
  if (found.logs.empty()) {
    const std::string stem = left.stem().string();
    const std::string log = FindFile(folder, {(stem + ".jsonl").c_str(), (stem + ".csv").c_str()});
    if (log.empty()) FailLog(found.left, "no log beside it");
    found.logs = {log};
  }
  return found;
}

VideoCounts UnpackVideo(const VideoRecording& recording, const std::string& folder,
                        const Progress& progress) {
  VideoCounts counts;
  const SensorLog log = ReadLogs(recording, &counts.warnings);
  std::vector<FrameFolder> folders;
  folders.emplace_back(folder + "/cam0");
  const bool has_right = recording.side_by_side || !recording.right.empty();
  if (has_right) folders.emplace_back(folder + "/cam1");
  const auto unpack = [&](const std::string& video, int camera,
                          const std::vector<FrameFolder*>& into, const Progress& part) {
    const FrameClock clock(video, ListedFrames(recording, log, camera, &counts.warnings), log);
    UnpackFrames(video, clock, into, part, &counts.warnings);
  };
  if (recording.side_by_side) {
    unpack(recording.left, 0, {&folders[0], &folders[1]}, progress);
  } else {
    unpack(recording.left, 0, {&folders[0]}, progress.Part(0, has_right ? 0.5 : 1));
    if (has_right) unpack(recording.right, 1, {&folders[1]}, progress.Part(0.5, 1));
  }
  MakeFolder(folder + "/imu0");
  WriteFile(folder + "/imu0/data.csv", ImuRows(log));
  counts.left = folders.front().Finish();
  counts.right = has_right ? folders.back().Finish() : 0;
  counts.imu = std::ssize(log.samples);
  return counts;
}

}  // namespace slcmap::data
