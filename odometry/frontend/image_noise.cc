#include "odometry/frontend/image_noise.h"

#include <algorithm>
#include <array>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace slcmap {
namespace {

// Variance of a block that is constant: cut off at an end of the scale, painted or compressed. It
// shows no noise, whatever there is elsewhere.
constexpr double kLeastDetail = 0.01;
constexpr double kNoiseSobelScale = 0.125;  // to grey values a pixel
constexpr int kBlock_px = 16;
constexpr int kLevels = 16;     // of brightness, evenly from 0 to 256
constexpr int kMinBlocks = 12;  // of a level that are enough to measure it
// Of the blocks of a level, by strength: what share is below the one that is taken for noise, and
// what that one has of the mean where all blocks show noise alone.
constexpr double kQuantile = 0.15, kQuantileOverMean = 0.88;
// Squares of the weights of the second difference in both directions (Immerkaer, "Fast noise
// variance estimation", 1996), which sees little of what a lens images.
constexpr double kDetailOfNoise = 36;
// The gradient has 0.19 of the variance that detail tells where noise differs from pixel to pixel,
// and 0.25 to 0.6 after bilinear resampling at 1.25 to 1 pixels a pixel. More is texture.
constexpr double kMaxGradientOverDetail = 0.7;
// Brightness of blocks without pixels at the ends of the scale, where noise is cut off.
constexpr double kDarkest = 2, kBrightest = 245;

struct NoiseBlock {
  double grey = 0;      // mean brightness
  double gradient = 0;  // variance of its components, mean of both
  double detail = 0;    // variance of the pixels that the finest detail would have as noise
};

// Over an area that has neighbours on all sides.
NoiseBlock Measure(const cv::Mat& image, const cv::Rect& area) {
  long sum = 0, sum_x = 0, sum_y = 0, sum_xx_yy = 0, sum_dd = 0;
  for (int v = area.y; v < area.y + area.height; ++v) {
    const uchar* above = image.ptr<uchar>(v - 1);
    const uchar* here = image.ptr<uchar>(v);
    const uchar* below = image.ptr<uchar>(v + 1);
    int row = 0, row_x = 0, row_y = 0, row_xx_yy = 0, row_dd = 0;
    for (int u = area.x; u < area.x + area.width; ++u) {
      const int a = above[u - 1], b = above[u], c = above[u + 1];
      const int d = here[u - 1], e = here[u], f = here[u + 1];
      const int g = below[u - 1], h = below[u], i = below[u + 1];
      const int x = c + 2 * f + i - a - 2 * d - g, y = g + 2 * h + i - a - 2 * b - c;
      const int detail = a + c + g + i - 2 * (b + d + f + h) + 4 * e;
      row += e;
      row_x += x;
      row_y += y;
      row_xx_yy += x * x + y * y;
      row_dd += detail * detail;
    }
    sum += row;
    sum_x += row_x;
    sum_y += row_y;
    sum_xx_yy += row_xx_yy;
    sum_dd += row_dd;
  }
  const auto n = static_cast<double>(area.area());
  const double x = static_cast<double>(sum_x) / n, y = static_cast<double>(sum_y) / n;
  const double gradient = static_cast<double>(sum_xx_yy) / n - x * x - y * y;
  return {static_cast<double>(sum) / n, 0.5 * kNoiseSobelScale * kNoiseSobelScale * gradient,
          static_cast<double>(sum_dd) / n / kDetailOfNoise};
}

}  // namespace

GradientNoise::GradientNoise(const cv::Mat& image, const cv::Mat& mask) {
  std::array<std::vector<NoiseBlock>, kLevels> blocks;
  for (int v = 1; v + kBlock_px < image.rows; v += kBlock_px) {
    for (int u = 1; u + kBlock_px < image.cols; u += kBlock_px) {
      const cv::Rect area(u, v, kBlock_px, kBlock_px);
      if (cv::countNonZero(mask(area)) < area.area()) continue;
      const NoiseBlock block = Measure(image, area);
      if (block.grey < kDarkest || block.grey > kBrightest) continue;
      if (block.detail < kLeastDetail) continue;
      if (block.gradient > kMaxGradientOverDetail * block.detail) continue;
      blocks[static_cast<int>(block.grey * kLevels / 256)].push_back(block);
    }
  }
  for (std::vector<NoiseBlock>& level : blocks) {
    if (std::ssize(level) < kMinBlocks) continue;
    const auto weak = level.begin() + static_cast<long>(kQuantile * level.size());
    std::nth_element(
        level.begin(), weak, level.end(),
        [](const NoiseBlock& a, const NoiseBlock& b) { return a.gradient < b.gradient; });
    double grey = 0;
    for (auto block = level.begin(); block <= weak; ++block) grey += block->grey;
    levels_.push_back({grey / (weak - level.begin() + 1), weak->gradient / kQuantileOverMean});
  }
}

double GradientNoise::VarianceAt(double grey) const {
  if (levels_.empty()) return 0;
  double variance = std::numeric_limits<double>::infinity();
  for (const Level& level : levels_) {
    variance = std::min(variance, level.variance * std::max(1.0, grey / level.grey));
  }
  return variance;
}

}  // namespace slcmap
