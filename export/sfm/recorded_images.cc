#include "export/sfm/recorded_images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>

#include "data/core/error.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline exporting {
namespace {

constexpr int64_t kSameStamp_ns = 1000000;  // poses may come from tables that round

// A recording that a map was made of.
struct RecordingOfMap {
  std::string path;
  SequenceOptions opened;
  int64_t stamps_moved_ns = 0;
  std::optional<StampSpan> poses_ns;
};

std::vector<RecordingOfMap> ListRecordings(const MapResult& map, const RecordingOptions& options) {
  if (map.source.merged.empty()) {
    return {{options.sequence.empty() ? map.source.sequence : options.sequence,
             map.source.opened,
             0,
             {}}};
  }
  if (!options.sequence.empty()) {
    throw ConfigError(
        "sequence: found a map that was merged of several recordings, expected one of a single "
        "recording: those of a merged map are read where map.json says they are");
  }
  std::vector<RecordingOfMap> recordings;
  for (const MergedRun& run : map.source.merged) {
    recordings.push_back({run.sequence, run.opened, run.stamps_moved_ns, run.poses_ns});
  }
  return recordings;
}

std::unique_ptr<SequenceSource> OpenRecordingAt(const RecordingOfMap& recording,
                                                const RecordingOptions& options) {
  std::error_code error;
  if (recording.path.empty() || !std::filesystem::exists(recording.path, error)) {
    throw DataError(fmt::format(
        "images: found no recording {}, expected the one that the map was made of (--sequence "
        "names where it moved to)",
        recording.path.empty() ? "named by the map" : recording.path));
  }
  return OpenAgain(recording.path, recording.opened, options.calibration);
}

}  // namespace

RecordedImages::RecordedImages(const MapResult& map, const RecordingOptions& options) {
  for (const RecordingOfMap& recording : ListRecordings(map, options)) {
    recordings_.push_back({recording.path, OpenRecordingAt(recording, options),
                           recording.stamps_moved_ns, recording.poses_ns});
  }
}

std::size_t RecordedImages::FindRecordingAt(int64_t stamp_ns) const {
  const auto found = std::ranges::find_if(recordings_, [&](const Recording& recording) {
    const std::optional<StampSpan>& span = recording.poses_ns;
    return !span || (stamp_ns >= span->from_ns && stamp_ns <= span->to_ns);
  });
  return static_cast<std::size_t>(found - recordings_.begin());
}

cv::Mat RecordedImages::Read(std::size_t recording, int64_t stamp_ns, int camera) const {
  const Recording& from = recordings_[recording];
  const std::vector<int64_t>& stamps_ns = from.source->info().pair_stamps_ns;
  const std::size_t at = ImageAt(stamps_ns, stamp_ns - from.stamps_moved_ns);
  return at == stamps_ns.size() ? cv::Mat() : from.source->ReadImage(at, camera).image;
}

void RecordedImages::Refuse(std::size_t recording, std::size_t count) const {
  throw DataError(fmt::format(
      "{}: found none of the {} images of the map that can be read, expected the recording that "
      "the map was made of",
      recordings_[recording].path, count));
}

cv::Mat RectifyingMap(const Rig& rectified, const Rig& raw, int camera) {
  const Camera& to = rectified.cameras[camera];
  const Eigen::Quaterniond R_raw_rectified =
      raw.T_imu_camera[camera].rotation.conjugate() * rectified.T_imu_camera[camera].rotation;
  cv::Mat map(to.height_px, to.width_px, CV_32FC2, cv::Scalar(-1, -1));
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const auto ray = to.Unproject({x, y});
      if (!ray) continue;
      const auto pixel_px = raw.cameras[camera].Project(R_raw_rectified * *ray);
      if (!pixel_px) continue;
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel_px->x()),
                                 static_cast<float>(pixel_px->y())};
    }
  }
  return map;
}

std::size_t ImageAt(const std::vector<int64_t>& stamps_ns, int64_t stamp_ns) {
  const auto at =
      std::lower_bound(stamps_ns.begin(), stamps_ns.end(), stamp_ns - kSameStamp_ns / 2);
  if (at == stamps_ns.end() || *at - stamp_ns > kSameStamp_ns / 2) return stamps_ns.size();
  return static_cast<std::size_t>(at - stamps_ns.begin());
}

}  // namespace slcmap::exporting
