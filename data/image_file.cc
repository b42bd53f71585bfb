#include "data/image_file.h"

#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "data/error.h"
#include "data/file.h"
#include "data/warnings.h"

namespace slcmap {
namespace {

// Decoders return a partly grey image for a file that was cut off; its end shows it.
bool IsTruncated(std::string_view bytes) {
  constexpr std::string_view kPngStart = "\x89PNG", kJpegStart = "\xff\xd8";
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

}  // namespace

ImageRead ReadGrayImage(const std::string& path, const cv::Size& size) {
  std::string bytes;
  try {
    bytes = ReadFile(path);
  } catch (const DataError&) {
    return {cv::Mat(), kImageMissing};
  }
  if (IsTruncated(bytes)) return {cv::Mat(), kImageTruncated};
  const cv::Mat image = Decode(bytes);
  if (image.empty()) return {cv::Mat(), kImageUndecodable};
  if (!size.empty() && image.size() != size) return {cv::Mat(), kImageWrongSize};
  return {image, nullptr};
}

}  // namespace slcmap
