#include "data/image_file.h"

#include <cstdio>
#include <filesystem>
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
  std::error_code error;  // a pipe would let the reader wait for ever
  if (!std::filesystem::is_regular_file(path, error)) return kImageMissing;
  try {
    *bytes = ReadFile(path);
  } catch (const DataError&) {
    return kImageMissing;
  }
  return IsTruncated(*bytes) ? kImageTruncated : nullptr;
}

using ImageHandle = std::unique_ptr<std::FILE, decltype(&std::fclose)>;

// Up to `count` bytes from an offset, which is from the end where it is negative.
std::string BytesAt(std::FILE* file, long offset, size_t count) {
  std::string bytes(count, '\0');
  const int from = offset < 0 ? SEEK_END : SEEK_SET;
  if (std::fseek(file, offset, from) != 0) return "";
  bytes.resize(std::fread(bytes.data(), 1, count, file));
  return bytes;
}

// The size that the frame header of a JPEG says; empty where there is none.
cv::Size JpegSize(std::FILE* file) {
  constexpr int kMaxSegments = 1000;
  long at = 2;
  for (int i = 0; i < kMaxSegments; ++i) {
    // Marker (2 bytes), length (2), and in a frame header precision (1), height (2), width (2).
    const std::string head = BytesAt(file, at, 9);
    if (head.size() < 9 || head[0] != '\xff') return {};
    const auto number = [&](size_t k) {
      return static_cast<unsigned char>(head[k]) << 8 | static_cast<unsigned char>(head[k + 1]);
    };
    const int kind = static_cast<unsigned char>(head[1]);
    const bool is_table = kind == 0xc4 || kind == 0xc8 || kind == 0xcc;
    if (kind >= 0xc0 && kind <= 0xcf && !is_table) return {number(7), number(5)};
    at += 2 + number(2);
  }
  return {};
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

const char* FindImageProblem(const std::string& path, const cv::Size& size) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return kImageMissing;
  const ImageHandle file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) return kImageMissing;
  const std::string start = BytesAt(file.get(), 0, 32);
  // Both ends in one, which is what the rule for whole files looks at.
  const std::string end = start.size() < 32 ? "" : BytesAt(file.get(), -12, 12);
  if (IsTruncated(start + end)) return kImageTruncated;
  if (!cv::haveImageReader(path)) return kImageUndecodable;
  const bool is_png = start.compare(0, kPngStart.size(), kPngStart) == 0;
  const cv::Size found = is_png ? PngSize(start) : JpegSize(file.get());
  return found.empty() || size.empty() || found == size ? nullptr : kImageWrongSize;
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
