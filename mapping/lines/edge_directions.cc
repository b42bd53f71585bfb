#include "mapping/lines/edge_directions.h"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

constexpr int kDirections = 16;
constexpr int kSobelGain = 8;  // of a 3x3 Sobel kernel against the change a pixel

int DirectionOf(double x, double y) {
  const double turns = std::atan2(y, x) / (2 * M_PI);
  return (static_cast<int>(std::lround(turns * kDirections)) + kDirections) % kDirections;
}

// The bits of a direction and its two neighbours.
std::array<uint16_t, kDirections> NeighbouringBits() {
  std::array<uint16_t, kDirections> bits{};
  for (int i = 0; i < kDirections; ++i) {
    for (int k : {kDirections - 1, 0, 1}) {
      bits[i] = static_cast<uint16_t>(bits[i] | 1 << (i + k) % kDirections);
    }
  }
  return bits;
}

// The step to the pixel that lies towards a gradient.
cv::Point StepTowards(int dx, int dy) {
  const int ax = std::abs(dx), ay = std::abs(dy);
  const int sx = dx > 0 ? 1 : -1, sy = dy > 0 ? 1 : -1;
  if (5 * ay < 2 * ax) return {sx, 0};  // tan 22.5 degrees is nearly 2 / 5
  if (5 * ax < 2 * ay) return {0, sy};
  return {sx, sy};
}

// The bits of each edge pixel by itself.
cv::Mat EdgePixels(const cv::Mat& image, double min_gradient) {
  static const std::array<uint16_t, kDirections> kBits = NeighbouringBits();
  cv::Mat dx, dy;
  cv::spatialGradient(image, dx, dy);
  const auto squared = [&](int v, int u) {
    const int x = dx.at<int16_t>(v, u), y = dy.at<int16_t>(v, u);
    return x * x + y * y;
  };
  const double least = std::pow(kSobelGain * min_gradient, 2);
  cv::Mat pixels = cv::Mat::zeros(image.size(), CV_16UC1);
  for (int v = 1; v + 1 < image.rows; ++v) {
    for (int u = 1; u + 1 < image.cols; ++u) {
      const int here = squared(v, u);
      if (here < least) continue;
      const int x = dx.at<int16_t>(v, u), y = dy.at<int16_t>(v, u);
      const cv::Point step = StepTowards(x, y);
      if (squared(v + step.y, u + step.x) > here || squared(v - step.y, u - step.x) > here) {
        continue;
      }
      pixels.at<uint16_t>(v, u) = kBits[DirectionOf(x, y)];
    }
  }
  return pixels;
}

}  // namespace

cv::Mat EdgeDirections(const cv::Mat& image, double min_gradient) {
  const cv::Mat pixels = EdgePixels(image, min_gradient);
  cv::Mat spread = cv::Mat::zeros(image.size(), CV_16UC1);
  for (int v = 1; v + 1 < image.rows; ++v) {
    for (int u = 1; u + 1 < image.cols; ++u) {
      const uint16_t bits = pixels.at<uint16_t>(v, u);
      if (bits == 0) continue;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) spread.at<uint16_t>(v + dv, u + du) |= bits;
      }
    }
  }
  return spread;
}

uint16_t DirectionBit(const Eigen::Vector2d& normal) {
  return static_cast<uint16_t>(1 << DirectionOf(normal.x(), normal.y()));
}

}  // namespace slcmap
