#include "data/io/image.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/light_dots.h"

namespace slcmap::inline data {
namespace {

constexpr std::string_view kPngStart = "\x89PNG";

unsigned ByteAt(std::string_view bytes, size_t at) { return static_cast<unsigned char>(bytes[at]); }

// Whether a JPEG has its end mark; those of pictures within its segments do not count.
bool HasJpegEnd(std::string_view bytes) {
  constexpr unsigned kEnd = 0xd9, kFill = 0xff;
  for (size_t at = bytes.find('\xff', 2); at < bytes.size() - 1; at = bytes.find('\xff', at)) {
    const unsigned kind = ByteAt(bytes, at + 1);
    if (kind == kEnd) return true;
    const bool has_length = kind > 1 && (kind < 0xd0 || kind > 0xd8) && kind != kFill;
    if (has_length && at + 3 >= bytes.size()) return false;
    at += kind == kFill ? 1 : 2;
    if (has_length) at += std::max(2U, ByteAt(bytes, at) << 8 | ByteAt(bytes, at + 1));
    if (at >= bytes.size()) return false;
  }
  return false;
}

// Whether a PNG has its last chunk, perhaps with other bytes behind it.
bool HasPngEnd(std::string_view bytes) {
  constexpr size_t kFirstChunk = 8, kAround = 12;  // length, type and checksum
  for (size_t at = kFirstChunk; at + kAround <= bytes.size();) {
    if (bytes.substr(at + 4, 4) == "IEND") return true;
    size_t length = 0;
    for (size_t i = at; i < at + 4; ++i) length = length << 8 | ByteAt(bytes, i);
    at += kAround + length;
  }
  return false;
}

bool IsPng(std::string_view bytes) { return bytes.substr(0, 4) == kPngStart; }

bool IsJpeg(std::string_view bytes) { return bytes.substr(0, 2) == "\xff\xd8"; }

// Whether the last bytes are those that a whole file of its kind ends with.
bool EndsWell(std::string_view bytes) {
  if (IsPng(bytes)) return bytes.size() >= 12 && bytes.substr(bytes.size() - 8, 4) == "IEND";
  if (IsJpeg(bytes)) return bytes.substr(bytes.size() - 2) == "\xff\xd9";
  return !bytes.empty();
}

// Decoders return a partly grey image for a file that was cut off; its end shows it.
bool IsTruncated(std::string_view bytes) {
  if (EndsWell(bytes)) return false;
  return IsPng(bytes) ? !HasPngEnd(bytes) : !IsJpeg(bytes) || !HasJpegEnd(bytes);
}

cv::Mat DecodeAs(const std::string& bytes, int flags) {
  if (bytes.empty()) return {};
  const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                       const_cast<char*>(bytes.data()));  // imdecode only reads it
  try {
    return cv::imdecode(buffer, flags);
  } catch (const cv::Exception&) {
    return cv::Mat();
  }
}

// The mean of a mosaic's colours about each pixel, which shifts nothing.
cv::Mat WithoutMosaic(const cv::Mat& image) {
  const cv::Mat kernel = (cv::Mat_<float>(1, 3) << 0.25F, 0.5F, 0.25F);
  cv::Mat gray;
  cv::sepFilter2D(image, gray, -1, kernel, kernel);
  return gray;
}

constexpr int kGreyAsStored = cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION;

// Of 16 bits the upper 8, as PNG files lose the lower ones.
cv::Mat UpperBits(const cv::Mat& pixels) {
  if (pixels.depth() != CV_16U) return pixels;
  const cv::Mat bytes(pixels.size(), CV_8UC2, pixels.data, pixels.step);
  cv::Mat upper;
  cv::extractChannel(bytes, upper, 1);
  return upper;
}

cv::Mat Decode(const KeptImage& kept, const PixelForm& form) {
  const bool whole = form.bits == 16, is_file = kept.pixels.empty();
  cv::Mat image;
  if (is_file) {
    image = DecodeAs(kept.bytes, whole ? kGreyAsStored : kGreyAsStored | cv::IMREAD_ANYDEPTH);
  } else {
    image = whole ? UpperBits(kept.pixels) : kept.pixels;
  }
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, std::ldexp(1, 8 - form.bits));
  if (image.empty()) return image;
  if (form.mosaic) image = WithoutMosaic(image);
  return form.dots ? WithoutDots(image) : image;
}

// The size that the header of a PNG tells; empty for other files.
cv::Size PngSize(std::string_view bytes) {
  constexpr size_t kWidthAt = 16, kHeightAt = 20, kHeaderEnd = 24;
  if (bytes.size() < kHeaderEnd || !IsPng(bytes)) return {};
  const auto number = [&](size_t at) {
    int value = 0;
    for (size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
  };
  return {number(kWidthAt), number(kHeightAt)};
}

// An image that is not truncated, or the problem.
KeptImage ReadWhole(const ImageStore& images, const std::string& path) {
  KeptImage kept = images.Read(path);
  if (kept.problem == nullptr && kept.pixels.empty() && IsTruncated(kept.bytes)) {
    kept.problem = kImageTruncated;
  }
  return kept;
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

// Up to `count` bytes from an offset.
using BytesReader = std::function<std::string(long offset, size_t count)>;

// The size that the frame header of a JPEG says; empty where there is none.
cv::Size JpegSize(const BytesReader& bytes_at) {
  constexpr int kMaxSegments = 1000;
  long at = 2;
  for (int i = 0; i < kMaxSegments; ++i) {
    // Marker (2 bytes), length (2), and in a frame header precision (1), height (2), width (2).
    const std::string head = bytes_at(at, 9);
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

bool IsOfSize(const cv::Size& found, const cv::Size& size) {
  return found.empty() || size.empty() || found == size;
}

ImageRead DecodeChecked(const KeptImage& kept, const cv::Size& size, const PixelForm& form) {
  const cv::Mat image = Decode(kept, form);
  if (image.empty()) return {cv::Mat(), kImageUndecodable};
  if (!IsOfSize(image.size(), size)) return {cv::Mat(), kImageWrongSize};
  return {image, nullptr};
}

class ImagesInFiles : public ImageStore {
 public:
  bool Has(const std::string& path) const override {
    std::error_code error;
    return std::filesystem::is_regular_file(path, error);
  }

  KeptImage Read(const std::string& path) const override {
    if (!Has(path)) return {"", {}, kImageMissing};  // a pipe would let the reader wait for ever
    try {
      return {ReadFile(path), {}, nullptr};
    } catch (const DataError&) {
      return {"", {}, kImageMissing};
    }
  }

  const char* FindProblem(const std::string& path, const cv::Size& size) const override {
    return FindImageProblem(path, size);
  }

  // Those of noisy images differ in size already.
  bool IsSame(const std::string& a, const std::string& b) const override {
    std::error_code error;
    if (std::filesystem::equivalent(a, b, error)) return true;
    const auto size = std::filesystem::file_size(a, error);
    if (error || size != std::filesystem::file_size(b, error) || error) return false;
    const KeptImage one = Read(a), other = Read(b);
    return one.problem == nullptr && other.problem == nullptr && one.bytes == other.bytes;
  }

  std::string State(const std::string& path) const override {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    const auto changed = std::filesystem::last_write_time(path, error).time_since_epoch().count();
    return fmt::format("{} {}", bytes, error ? 0 : changed);
  }
};

}  // namespace

SharedImageStore FileImages() {
  static const SharedImageStore images = std::make_shared<ImagesInFiles>();
  return images;
}

ImageRead ReadGrayImage(const ImageStore& images, const std::string& path, const cv::Size& size,
                        const PixelForm& form) {
  const KeptImage kept = ReadWhole(images, path);
  if (kept.problem != nullptr) return {cv::Mat(), kept.problem};
  return DecodeChecked(kept, size, form);
}

ImageRead ReadGrayImage(const std::string& path, const cv::Size& size, const PixelForm& form) {
  return ReadGrayImage(*FileImages(), path, size, form);
}

namespace {

// With the depth and the channels that are kept.
cv::Mat AsStored(const KeptImage& kept) {
  if (kept.problem != nullptr) return {};
  return kept.pixels.empty() ? DecodeAs(kept.bytes, cv::IMREAD_UNCHANGED) : kept.pixels;
}

// Whether viewers show the image turned or mirrored, as its EXIF data ask for.
bool IsTurnedByOrientation(const KeptImage& kept) {
  if (kept.problem != nullptr || !kept.pixels.empty()) return false;
  const cv::Mat stored = DecodeAs(kept.bytes, kGreyAsStored);
  const cv::Mat shown = DecodeAs(kept.bytes, cv::IMREAD_GRAYSCALE);
  return stored.size() != shown.size() || cv::norm(stored, shown, cv::NORM_INF) > 0;
}

}  // namespace

cv::Mat ReadStoredImage(const std::string& path) {
  return AsStored(ReadWhole(*FileImages(), path));
}

cv::Mat StoredGray(const KeptImage& kept) {
  if (kept.problem != nullptr || !kept.pixels.empty()) return kept.pixels;
  if (IsTruncated(kept.bytes)) return {};
  return DecodeAs(kept.bytes, kGreyAsStored | cv::IMREAD_ANYDEPTH);
}

const char* FindImageProblem(const std::string& path, const cv::Size& size) {
  if (!FileImages()->Has(path)) return kImageMissing;
  const ImageHandle file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) return kImageMissing;
  const std::string start = BytesAt(file.get(), 0, 32);
  // Both ends in one, which is what the rule for whole files looks at.
  const std::string end = start.size() < 32 ? "" : BytesAt(file.get(), -12, 12);
  if (!EndsWell(start + end)) {  // perhaps for bytes behind its end
    const KeptImage kept = ReadWhole(*FileImages(), path);
    if (kept.problem != nullptr) return kept.problem;
  }
  if (!cv::haveImageReader(path)) return kImageUndecodable;
  const auto bytes_at = [&](long offset, size_t count) {
    return BytesAt(file.get(), offset, count);
  };
  return IsOfSize(IsPng(start) ? PngSize(start) : JpegSize(bytes_at), size) ? nullptr
                                                                            : kImageWrongSize;
}

const char* FindProblemOfBytes(const std::string& bytes, const cv::Size& size) {
  if (IsTruncated(bytes)) return kImageTruncated;
  const auto bytes_at = [&](long offset, size_t count) {
    const auto at = static_cast<size_t>(offset);
    return at < bytes.size() ? bytes.substr(at, count) : std::string();
  };
  return IsOfSize(IsPng(bytes) ? PngSize(bytes) : JpegSize(bytes_at), size) ? nullptr
                                                                            : kImageWrongSize;
}

DeferredImageRead ReadGrayImageDeferred(const ImageStore& images, const std::string& path,
                                        const cv::Size& size, const PixelForm& form) {
  const auto kept = std::make_shared<KeptImage>(ReadWhole(images, path));
  if (kept->problem != nullptr) return {nullptr, kept->problem};
  if (!size.empty() && PngSize(kept->bytes) == size) {
    return {[kept, form] { return Decode(*kept, form); }, nullptr};
  }
  const ImageRead read = DecodeChecked(*kept, size, form);
  return {[image = read.image] { return image; }, read.problem};
}

namespace {

constexpr size_t kFormSamples = 4, kDeepSamples = 48;
constexpr int kWholeBits = 16;

double RootMeanSquare(const cv::Mat& image) {
  return cv::norm(image) / std::sqrt(static_cast<double>(std::max<size_t>(1, image.total())));
}

// How much both diagonals of each 2 x 2 differ. That of a scene changes its sign from one to the
// next, that of a mosaic is the same over areas of one colour.
bool ShowsMosaic(const cv::Mat& image) {
  constexpr int kArea = 8;                          // of 2 x 2
  constexpr double kMinLevel = 1, kMinShare = 0.4;  // scenes come to 0.2 and 0.1
  if (image.channels() != 1 || image.cols < 4 * kArea || image.rows < 4 * kArea) return false;
  cv::Mat levels, diagonal;
  image.convertTo(levels, CV_32F, image.depth() == CV_16U ? 1.0 / 256 : 1);
  const cv::Mat kernel = (cv::Mat_<float>(2, 2) << 0.25F, -0.25F, -0.25F, 0.25F);
  cv::filter2D(levels, diagonal, CV_32F, kernel, cv::Point(0, 0));
  const cv::Size half(image.cols / 2, image.rows / 2);
  cv::Mat each, areas;
  cv::resize(diagonal(cv::Rect(0, 0, 2 * half.width, 2 * half.height)), each, half, 0, 0,
             cv::INTER_NEAREST);
  const cv::Size whole(half.width / kArea, half.height / kArea);
  cv::resize(each(cv::Rect(0, 0, kArea * whole.width, kArea * whole.height)), areas, whole, 0, 0,
             cv::INTER_AREA);
  const double level = RootMeanSquare(areas), scene = RootMeanSquare(each);
  return level > kMinLevel && level > kMinShare * scene;
}

// What a sample of one camera's images shows.
struct FormSeen {
  int images = 0, mosaics = 0;
  bool deep = false, is_turned = false;
  double most = 0;                  // value
  std::vector<cv::Mat> first = {};  // as 8 bits
};

// Until 16 bits are proved; of files that are not deep a few will do.
FormSeen LookAtForm(const ImageStore& images, const std::vector<std::string>& paths) {
  FormSeen seen;
  size_t samples = std::min(kFormSamples, paths.size());
  for (size_t i = 0; i < samples; ++i) {
    const KeptImage kept = ReadWhole(images, paths[i * paths.size() / samples]);
    const cv::Mat image = AsStored(kept);
    if (image.empty()) continue;
    if (image.depth() == CV_16U && !seen.deep) {
      seen.deep = true;
      samples = std::min(kDeepSamples, paths.size());
    }
    if (seen.images++ == 0) seen.is_turned = IsTurnedByOrientation(kept);
    if (seen.images <= static_cast<int>(kFormSamples)) {
      seen.mosaics += ShowsMosaic(image);
      seen.first.push_back(Decode(kept, {}));
    }
    double most = 0;
    cv::minMaxLoc(image.reshape(1), nullptr, &most);
    seen.most = std::max(seen.most, most);
    const bool is_whole = seen.most >= (1 << 14);
    if (is_whole && seen.images >= static_cast<int>(kFormSamples)) break;
  }
  return seen;
}

// The bits that values up to `most` need, of those that sensors have.
int BitsFor(double most) {
  for (const int bits : {8, 10, 12, 14}) {
    if (most < (1 << bits)) return bits;
  }
  return kWholeBits;
}

}  // namespace

std::vector<PixelForm> FindPixelForms(const ImageStore& images,
                                      const std::vector<std::vector<std::string>>& paths,
                                      Warnings* warnings) {
  std::vector<FormSeen> seen;
  std::vector<PixelForm> forms(paths.size());
  for (const auto& of_camera : paths) seen.push_back(LookAtForm(images, of_camera));
  const bool deep = std::ranges::any_of(seen, &FormSeen::deep);
  const double most = std::ranges::max(seen, {}, &FormSeen::most).most;
  for (size_t camera = 0; camera < paths.size(); ++camera) {
    if (seen[camera].images == 0) continue;
    const auto tell = [&](const char* kind, const std::string& words) {
      const std::string folder =
          std::filesystem::path(paths[camera].front()).parent_path().string();
      if (warnings != nullptr) warnings->Add(kind, folder + ": " + words);
    };
    forms[camera].bits = deep && most > 0 ? BitsFor(most) : kWholeBits;
    forms[camera].mosaic = 2 * seen[camera].mosaics > seen[camera].images;
    if (seen[camera].deep && forms[camera].bits < kWholeBits) {
      tell(kImageFewBits,
           fmt::format("values up to {:.0f} of 65535, read as {} bits (multiplied by {})", most,
                       forms[camera].bits, 1 << (kWholeBits - forms[camera].bits)));
    }
    if (forms[camera].mosaic) {
      tell(kImageMosaic, "a Bayer mosaic, read as grey by averaging over its colours");
    }
    forms[camera].dots = ShowSameDots(seen[camera].first);
    if (forms[camera].dots) tell(kImageDots, "switch the emitter off where depth is not needed");
    if (seen[camera].is_turned) {
      tell(kImageOrientation,
           "EXIF asks for turned images; pixels are taken as the sensor has "
           "stored them, for which the calibration is");
    }
  }
  return forms;
}

std::string EncodePng(const cv::Mat& image) {
  std::vector<uchar> bytes;
  cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void WritePng(const std::string& path, const cv::Mat& image) { WriteFile(path, EncodePng(image)); }

}  // namespace slcmap::data
