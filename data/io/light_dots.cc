#include "data/io/light_dots.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "data/io/image.h"

namespace slcmap::inline data {
namespace {

constexpr int kDot_px = 5;       // a dot is smaller
constexpr double kLeastDot = 6;  // levels over what is around it: noise is less

cv::Mat Opened(const cv::Mat& image) {
  static const cv::Mat kernel =
      cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(kDot_px, kDot_px));
  cv::Mat opened;
  cv::morphologyEx(image, opened, cv::MORPH_OPEN, kernel);
  return opened;
}

// What of an image may be dots: their height, 0 elsewhere.
cv::Mat Spots(const cv::Mat& image) {
  cv::Mat spots;
  cv::subtract(image, Opened(image), spots);
  spots.setTo(0, spots < kLeastDot);
  return spots;
}

// Of two images as a whole.
double Likeness(const cv::Mat& a, const cv::Mat& b) {
  constexpr int kSmall_px = 32;
  cv::Mat small_a, small_b, likeness;
  cv::resize(a, small_a, cv::Size(kSmall_px, kSmall_px), 0, 0, cv::INTER_AREA);
  cv::resize(b, small_b, cv::Size(kSmall_px, kSmall_px), 0, 0, cv::INTER_AREA);
  cv::matchTemplate(small_a, small_b, likeness, cv::TM_CCOEFF_NORMED);
  return likeness.at<float>(0, 0);
}

// Whether most parts of `a` that have spots are found in `b`.
bool SpotsRecur(const cv::Mat& a, const cv::Mat& b) {
  constexpr int kPart_px = 48, kReach_px = 32;
  constexpr double kLeastMatch = 0.45, kLeastShare = 0.4, kLeastMean = 0.3;
  int with_spots = 0, found = 0;
  for (int y = 0; y + kPart_px <= a.rows; y += kPart_px) {
    for (int x = kReach_px; x + kPart_px + kReach_px <= a.cols; x += kPart_px) {
      const cv::Mat part = a(cv::Rect(x, y, kPart_px, kPart_px));
      if (cv::mean(part)[0] < kLeastMean) continue;
      cv::Mat matches;
      cv::matchTemplate(b(cv::Rect(x - kReach_px, y, kPart_px + 2 * kReach_px, kPart_px)), part,
                        matches, cv::TM_CCOEFF_NORMED);
      double best = 0;
      cv::minMaxLoc(matches, nullptr, &best);
      ++with_spots;
      found += best > kLeastMatch;
    }
  }
  constexpr int kLeastParts = 12;
  return with_spots >= kLeastParts && found > kLeastShare * with_spots;
}

}  // namespace

cv::Mat WithoutDots(const cv::Mat& image) {
  cv::Mat without = image.clone();
  const cv::Mat opened = Opened(image);
  cv::Mat height;
  cv::subtract(image, opened, height);
  opened.copyTo(without, height >= kLeastDot);
  return without;
}

double DotLevel(const cv::Mat& image) {
  const double mean = cv::mean(image)[0];
  return mean > 0 ? cv::mean(Spots(image))[0] / mean : 0;
}

bool ShowSameDots(const std::vector<cv::Mat>& images) {
  constexpr double kAlike = 0.8;
  int compared = 0, recurring = 0;
  for (size_t i = 1; i < images.size(); ++i) {
    const cv::Mat &a = images[i - 1], &b = images[i];
    if (a.size() != b.size() || Likeness(a, b) > kAlike) continue;
    ++compared;
    recurring += SpotsRecur(Spots(a), Spots(b));
  }
  return compared > 0 && 2 * recurring > compared;
}

namespace {

constexpr size_t kRun = 6, kRuns = 3;     // of images one after the other, over the recording
constexpr double kLitToDark = 1.5;        // of the level of dots, at least
constexpr double kLeastLitLevel = 0.003;  // of dots in the lit ones

// Whether every other image of a run is lit. Ends as soon as that cannot be any more.
bool IsLitInTurn(const ImageStore& images, const std::vector<std::string>& paths, size_t begin) {
  std::array<double, 2> most = {0, 0}, least = {1e9, 1e9};  // of images by turns
  const auto may_be_lit = [&](size_t turn) {
    return least[turn] > std::max(kLeastLitLevel, kLitToDark * most[1 - turn]);
  };
  for (size_t i = begin; i < begin + kRun; ++i) {
    const cv::Mat image = ReadGrayImage(images, paths[i], {}).image;
    if (image.empty()) return false;
    const double level = DotLevel(image);
    most[i % 2] = std::max(most[i % 2], level);
    least[i % 2] = std::min(least[i % 2], level);
    if (!may_be_lit(0) && !may_be_lit(1)) return false;
  }
  return true;
}

}  // namespace

std::vector<size_t> FindLitImages(const ImageStore& images, const std::vector<std::string>& paths) {
  if (paths.size() < kRuns * kRun) return {};
  size_t alternating = 0;  // a lost image may be in one
  for (size_t run = 0; run < kRuns; ++run) {
    alternating += IsLitInTurn(images, paths, run * (paths.size() - kRun) / (kRuns - 1));
    if (run > alternating) return {};
  }
  // A lost image changes which are lit: each is told by itself and its neighbours.
  std::vector<double> levels;
  for (const std::string& path : paths) {
    const cv::Mat image = ReadGrayImage(images, path, {}).image;
    levels.push_back(image.empty() ? 0 : DotLevel(image));
  }
  std::vector<size_t> lit;
  for (size_t i = 0; i < paths.size(); ++i) {
    const double before = levels[i > 0 ? i - 1 : i + 1];
    const double behind = levels[i + 1 < paths.size() ? i + 1 : i - 1];
    if (levels[i] > std::max(kLeastLitLevel, std::min(before, behind) * kLitToDark))
      lit.push_back(i);
  }
  return lit;
}

}  // namespace slcmap::data
