#include "data/video/unpack_video.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"
#include "data/video/sensor_log.h"
#include "data/video/video_file.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

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
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder)) {
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
  if (fs::is_directory(path)) return !FindFile(path, {"data.mkv", "data.mp4"}).empty();
  return IsVideoName(path);
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
