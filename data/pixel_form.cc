#include "data/pixel_form.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

constexpr size_t kFormSamples = 4, kDeepSamples = 48;
constexpr int kWholeBits = 16;

double RootMeanSquare(const cv::Mat& image) {
  return cv::norm(image) / std::sqrt(static_cast<double>(std::max<size_t>(1, image.total())));
}

// How much both diagonals of each 2 x 2 differ. That of a scene changes its sign from one to the
// next, that of a mosaic is the same over areas of one colour.
bool ShowsMosaic(const cv::Mat& image) {
  constexpr int kArea = 8;                              // of 2 x 2
  constexpr double kMinLevel = 1, kMinShare = 0.4;      // scenes come to 0.2 and 0.1
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
  double most = 0;  // value
};

// Until 16 bits are proved; of files that are not deep a few will do.
FormSeen LookAtForm(const std::vector<std::string>& paths) {
  FormSeen seen;
  size_t samples = std::min(kFormSamples, paths.size());
  for (size_t i = 0; i < samples; ++i) {
    const std::string& path = paths[i * paths.size() / samples];
    const cv::Mat image = ReadStoredImage(path);
    if (image.empty()) continue;
    if (image.depth() == CV_16U && !seen.deep) {
      seen.deep = true;
      samples = std::min(kDeepSamples, paths.size());
    }
    if (seen.images++ == 0) seen.is_turned = IsTurnedByOrientation(path);
    if (seen.images <= static_cast<int>(kFormSamples)) seen.mosaics += ShowsMosaic(image);
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

std::array<PixelForm, 2> FindPixelForms(const std::array<std::vector<std::string>, 2>& paths,
                                        Warnings* warnings) {
  std::array<FormSeen, 2> seen;
  std::array<PixelForm, 2> forms;
  for (size_t camera = 0; camera < 2; ++camera) seen[camera] = LookAtForm(paths[camera]);
  const bool deep = seen[0].deep || seen[1].deep;
  const double most = std::max(seen[0].most, seen[1].most);
  for (size_t camera = 0; camera < 2; ++camera) {
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
    if (seen[camera].is_turned) {
      tell(kImageOrientation, "EXIF asks for turned images; pixels are taken as the sensor has "
                              "stored them, for which the calibration is");
    }
  }
  return forms;
}

}  // namespace slcmap
