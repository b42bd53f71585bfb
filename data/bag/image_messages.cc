#include "data/bag/image_messages.h"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

struct PixelLayout {
  int type = CV_8UC1, conversion = -1;  // -1: grey already
};

const PixelLayout* LayoutFor(const std::string& encoding) {
  static const std::map<std::string, PixelLayout> kLayouts = {
      {"mono8", {CV_8UC1, -1}},
      {"8UC1", {CV_8UC1, -1}},
      {"mono16", {CV_16UC1, -1}},
      {"16UC1", {CV_16UC1, -1}},
      {"bgr8", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"8UC3", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"rgb8", {CV_8UC3, cv::COLOR_RGB2GRAY}},
      {"bgra8", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      {"8UC4", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      {"rgba8", {CV_8UC4, cv::COLOR_RGBA2GRAY}},
      {"yuv422", {CV_8UC2, cv::COLOR_YUV2GRAY_UYVY}},
      {"yuv422_yuy2", {CV_8UC2, cv::COLOR_YUV2GRAY_YUY2}},
      // OpenCV names a mosaic by the second row's second and third pixels.
      {"bayer_rggb8", {CV_8UC1, cv::COLOR_BayerBG2GRAY}},
      {"bayer_bggr8", {CV_8UC1, cv::COLOR_BayerRG2GRAY}},
      {"bayer_gbrg8", {CV_8UC1, cv::COLOR_BayerGR2GRAY}},
      {"bayer_grbg8", {CV_8UC1, cv::COLOR_BayerGB2GRAY}}};
  const auto layout = kLayouts.find(encoding);
  return layout == kLayouts.end() ? nullptr : &layout->second;
}

size_t RowBytes(const RosImage& image, const PixelLayout& layout) {
  return image.width_px * static_cast<size_t>(CV_ELEM_SIZE(layout.type));
}

}  // namespace

std::optional<size_t> PixelBytes(const RosImage& image) {
  const PixelLayout* const layout = LayoutFor(image.encoding);
  if (layout == nullptr) return std::nullopt;
  if (image.height_px == 0) return 0;
  const size_t row_bytes = RowBytes(image, *layout);
  return (image.height_px - 1) * std::max<size_t>(image.step_bytes, row_bytes) + row_bytes;
}

std::optional<cv::Mat> GreyFrom(const RosImage& image) {
  const PixelLayout* const layout = LayoutFor(image.encoding);
  if (layout == nullptr) return std::nullopt;
  if (image.width_px == 0 || image.height_px == 0 || image.data.bytes.size() < PixelBytes(image)) {
    throw DataError("fewer pixels than its size says");
  }
  const cv::Mat stored(static_cast<int>(image.height_px), static_cast<int>(image.width_px),
                       layout->type, const_cast<std::byte*>(image.data.bytes.data()),
                       std::max<size_t>(image.step_bytes, RowBytes(image, *layout)));
  cv::Mat grey;
  if (layout->conversion < 0) {
    grey = stored.clone();
  } else {
    cv::cvtColor(stored, grey, layout->conversion);
  }
  if (grey.depth() == CV_16U && image.is_bigendian) {
    for (auto pixel = grey.begin<uint16_t>(); pixel != grey.end<uint16_t>(); ++pixel) {
      *pixel = static_cast<uint16_t>(*pixel << 8 | *pixel >> 8);
    }
  }
  return grey;
}

std::string ExtensionFor(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return ".png";
  return bytes.starts_with("\xff\xd8") ? ".jpg" : "";
}

}  // namespace slcmap::data
