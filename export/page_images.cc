#include "export/page_images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr int64_t kSameStamp_ns = 1000000;  // poses may come from tables that round

// Of each pixel of a rectified image, the raw camera's; beyond the image where there is none.
cv::Mat RectifyingMap(const Rig& rectified, const Rig& raw) {
  const Camera& camera = rectified.cameras[0];
  const Eigen::Quaterniond R_raw_rectified =
      raw.T_imu_camera[0].rotation.conjugate() * rectified.T_imu_camera[0].rotation;
  cv::Mat map(camera.height_px, camera.width_px, CV_32FC2, cv::Scalar(-1, -1));
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const auto ray = camera.Unproject({x, y});
      if (!ray) continue;
      const auto pixel_px = raw.cameras[0].Project(R_raw_rectified * *ray);
      if (!pixel_px) continue;
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel_px->x()),
                                 static_cast<float>(pixel_px->y())};
    }
  }
  return map;
}

// Rectifies before it makes smaller, so that each pixel is a mean of those that it stands for.
std::string Jpeg(const cv::Mat& raw, const cv::Mat& map, const PageImageOptions& options) {
  cv::Mat image;
  cv::remap(raw, image, map, cv::noArray(), cv::INTER_LINEAR);
  const double scale = std::min(1.0, static_cast<double>(options.width_px) / image.cols);
  cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, options.quality});
  return {bytes.begin(), bytes.end()};
}

// The index of the recording's image at a stamp.
std::optional<std::size_t> ImageAt(const std::vector<int64_t>& stamps_ns, int64_t stamp_ns) {
  const auto at =
      std::lower_bound(stamps_ns.begin(), stamps_ns.end(), stamp_ns - kSameStamp_ns / 2);
  if (at == stamps_ns.end() || *at - stamp_ns > kSameStamp_ns / 2) return std::nullopt;
  return static_cast<std::size_t>(at - stamps_ns.begin());
}

[[noreturn]] void RefuseRecording(const MapResult& map, const SequenceSource& recording) {
  throw DataError(fmt::format(
      "{}: found none of the images of the map's {} keyframes that can be read, expected the "
      "recording that the map was made of",
      recording.info().name, map.keyframes.size()));
}

}  // namespace

void PageImageOptions::Check() const {
  if (most < 1) throw ConfigError(fmt::format("most: found {}, expected at least 1", most));
  if (width_px < 16) {
    throw ConfigError(fmt::format("width_px: found {}, expected at least 16", width_px));
  }
  if (quality >= 1 && quality <= 100) return;
  throw ConfigError(fmt::format("quality: found {}, expected 1 to 100", quality));
}

std::vector<PageImage> ReadPageImages(const MapResult& map, const SequenceSource& recording,
                                      const PageImageOptions& options, const Progress& progress) {
  options.Check();
  const cv::Mat rectifying = RectifyingMap(map.rectified_rig, recording.info().rig);
  const auto most = static_cast<std::size_t>(options.most);
  const std::size_t step = std::max<std::size_t>(1, (map.keyframes.size() + most - 1) / most);
  std::vector<PageImage> images;
  for (std::size_t i = 0; i < map.keyframes.size(); i += step) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(map.keyframes.size()));
    const auto at = ImageAt(recording.info().pair_stamps_ns, map.keyframes[i].stamp_ns);
    if (!at) continue;
    const cv::Mat raw = recording.ReadImage(*at, 0).image;
    if (!raw.empty()) images.push_back({i, Jpeg(raw, rectifying, options)});
  }
  if (images.empty() && !map.keyframes.empty()) RefuseRecording(map, recording);
  return images;
}

}  // namespace slcmap
