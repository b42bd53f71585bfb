#include "export/page_images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/error.h"
#include "export/rectified_images.h"

namespace slcmap {
namespace {

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
  const cv::Mat rectifying = RectifyingMap(map.rectified_rig, recording.info().rig, 0);
  const auto most = static_cast<std::size_t>(options.most);
  const std::size_t step = std::max<std::size_t>(1, (map.keyframes.size() + most - 1) / most);
  std::vector<PageImage> images;
  for (std::size_t i = 0; i < map.keyframes.size(); i += step) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(map.keyframes.size()));
    const std::size_t at = ImageAt(recording.info().pair_stamps_ns, map.keyframes[i].stamp_ns);
    if (at == recording.info().pair_stamps_ns.size()) continue;
    const cv::Mat raw = recording.ReadImage(at, 0).image;
    if (!raw.empty()) images.push_back({i, Jpeg(raw, rectifying, options)});
  }
  if (images.empty() && !map.keyframes.empty()) RefuseRecording(map, recording);
  return images;
}

}  // namespace slcmap
