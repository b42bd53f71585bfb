#include "export/rectified_images.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/error.h"
#include "data/file.h"
#include "data/source/asl_source.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kSameStamp_ns = 1000000;  // poses may come from tables that round

// A recording that a map was made of, and when its poses are.
struct RecordingOfMap {
  std::string path;
  SequenceOptions opened;
  int64_t stamps_moved_ns = 0;
  std::optional<StampSpan> poses_ns;  // none: all
};

std::vector<RecordingOfMap> RecordingsOf(const MapResult& map, const ColmapOptions& options) {
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

std::unique_ptr<SequenceSource> OpenRecordingOf(const RecordingOfMap& recording,
                                                const ColmapOptions& options) {
  std::error_code error;
  if (recording.path.empty() || !fs::exists(recording.path, error)) {
    throw DataError(fmt::format(
        "colmap images: found no recording {}, expected the one that the map was made of "
        "(--sequence names where it moved to)",
        recording.path.empty() ? "named by the map" : recording.path));
  }
  return OpenAgain(recording.path, recording.opened, options.calibration);
}

bool IsOf(const RecordingOfMap& recording, int64_t stamp_ns) {
  return !recording.poses_ns ||
         (stamp_ns >= recording.poses_ns->from_ns && stamp_ns <= recording.poses_ns->to_ns);
}

// Rectifies the images of one recording.
class ImageRectifier {
 public:
  ImageRectifier(const MapResult& map, const SequenceSource& recording)
      : recording_(recording), rectified_(map.rectified_rig) {
    for (int i = 0; i < 2; ++i) {
      if (!IsCalibrated(rectified_.cameras[i])) continue;
      maps_[i] = RectifyingMap(rectified_, recording.info().rig, i);
    }
  }

  // Empty where the recording has none at the stamp, or it cannot be read.
  cv::Mat At(int64_t stamp_ns, int camera) const {
    const std::vector<int64_t>& stamps_ns = recording_.info().pair_stamps_ns;
    const std::size_t at = ImageAt(stamps_ns, stamp_ns);
    if (at == stamps_ns.size()) return {};
    const cv::Mat raw = recording_.ReadImage(at, camera).image;
    if (raw.empty()) return {};
    cv::Mat image;
    cv::remap(raw, image, maps_[camera], cv::noArray(), cv::INTER_CUBIC);
    return image;
  }

 private:
  const SequenceSource& recording_;
  const Rig& rectified_;
  std::array<cv::Mat, 2> maps_;
};

void WriteImage(const std::string& path, const cv::Mat& image) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes);
  MakeFolder(fs::path(path).parent_path());
  WriteFile(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace

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

std::vector<std::string> WriteRectifiedImages(const std::string& folder, const MapResult& map,
                                              const std::vector<ModelImage>& images,
                                              const ColmapOptions& options,
                                              const Progress& progress) {
  std::vector<std::string> paths;
  std::size_t missing = 0;
  for (const RecordingOfMap& recording : RecordingsOf(map, options)) {
    const std::unique_ptr<SequenceSource> source = OpenRecordingOf(recording, options);
    const ImageRectifier rectifier(map, *source);
    const std::size_t before = paths.size(), missing_before = missing;
    for (const ModelImage& image : images) {
      if (!IsOf(recording, image.stamp_ns)) continue;
      progress.ReportOrStop(static_cast<double>(paths.size()) / static_cast<double>(images.size()));
      const cv::Mat rectified =
          rectifier.At(image.stamp_ns - recording.stamps_moved_ns, image.camera);
      if (rectified.empty()) {
        ++missing;
        continue;
      }
      paths.push_back(folder + "/" + image.name);
      WriteImage(paths.back(), rectified);
    }
    if (paths.size() > before || missing == missing_before) continue;
    throw DataError(fmt::format(
        "{}: found none of the {} images of the map that can be read, expected the recording that "
        "the map was made of",
        recording.path, missing - missing_before));
  }
  if (missing > 0) {
    spdlog::warn("colmap/images: {} of {} images cannot be read and are left out", missing,
                 images.size());
  }
  spdlog::info("wrote {} images into colmap/images", paths.size());
  return paths;
}

}  // namespace slcmap
