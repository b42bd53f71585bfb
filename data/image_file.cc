#include "data/image_file.h"

#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "data/error.h"
#include "data/file.h"
#include "data/warnings.h"

namespace slcmap {
namespace {

constexpr std::string_view kPngStart = "\x89PNG";

// Decoders return a partly grey image for a file that was cut off; its end shows it.
bool IsTruncated(std::string_view bytes) {
  constexpr std::string_view kJpegStart = "\xff\xd8";
  constexpr size_t kPngEnd = 12;  // length, "IEND", checksum
  if (bytes.substr(0, 4) == kPngStart) {
    return bytes.size() < kPngEnd || bytes.substr(bytes.size() - 8, 4) != "IEND";
  }
  if (bytes.substr(0, 2) == kJpegStart) return bytes.substr(bytes.size() - 2) != "\xff\xd9";
  return bytes.empty();
}

cv::Mat Decode(const std::string& bytes) {
  const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                       const_cast<char*>(bytes.data()));  // imdecode only reads it
  try {
    return cv::imdecode(buffer, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return cv::Mat();
  }
}

// The size that the header of a PNG tells; empty for other files.
cv::Size PngSize(std::string_view bytes) {
  constexpr size_t kWidthAt = 16, kHeightAt = 20, kHeaderEnd = 24;
  if (bytes.size() < kHeaderEnd || bytes.substr(0, 4) != kPngStart) return {};
  const auto number = [&](size_t at) {
    int value = 0;
    for (size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
  };
  return {number(kWidthAt), number(kHeightAt)};
}

// Reads a file that is not truncated; returns the problem where there is one.
const char* ReadWhole(const std::string& path, std::string* bytes) {
  try {
    *bytes = ReadFile(path);
  } catch (const DataError&) {
    return kImageMissing;
  }
  return IsTruncated(*bytes) ? kImageTruncated : nullptr;
}

ImageRead DecodeChecked(const std::string& bytes, const cv::Size& size) {
  const cv::Mat image = Decode(bytes);
  if (image.empty()) return {cv::Mat(), kImageUndecodable};
  if (!size.empty() && image.size() != size) return {cv::Mat(), kImageWrongSize};
  return {image, nullptr};
}

}  // namespace

ImageRead ReadGrayImage(const std::string& path, const cv::Size& size) {
  std::string bytes;
  if (const char* problem = ReadWhole(path, &bytes)) return {cv::Mat(), problem};
  return DecodeChecked(bytes, size);
}

DeferredImageRead ReadGrayImageDeferred(const std::string& path, const cv::Size& size) {
  const auto bytes = std::make_shared<std::string>();
  if (const char* problem = ReadWhole(path, bytes.get())) return {nullptr, problem};
  if (!size.empty() && PngSize(*bytes) == size) {
    return {[bytes] { return Decode(*bytes); }, nullptr};
  }
  const ImageRead read = DecodeChecked(*bytes, size);
  return {[image = read.image] { return image; }, read.problem};
}

}  // namespace slcmap
