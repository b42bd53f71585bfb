#include "odometry/frontend/edge_crossing.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace slcmap {
namespace {

constexpr int kCrossingRadius_px = 5;
constexpr int kCrossingSide_px = 2 * kCrossingRadius_px + 1;
constexpr double kWeightSigma_px = 2.5;
constexpr int kMaxSteps = 6;
constexpr double kMinStep_px = 0.05;
constexpr double kCrossingMaxShift_px = 5;  // from where the corner was detected

using Eigen::Vector2d;

const std::array<double, kCrossingSide_px>& Weights() {
  static const auto weights = [] {
    std::array<double, kCrossingSide_px> w{};
    for (int i = 0; i < kCrossingSide_px; ++i) {
      const double x = (i - kCrossingRadius_px) / kWeightSigma_px;
      w[static_cast<size_t>(i)] = std::exp(-0.5 * x * x);
    }
    return w;
  }();
  return weights;
}

// From the pixel (u, v), which is as far from the border as the sums reach.
Vector2d CrossingAbout(const cv::Mat& image, int u, int v) {
  double xx = 0, xy = 0, yy = 0;
  Vector2d sum = Vector2d::Zero();
  for (int y = -kCrossingRadius_px; y <= kCrossingRadius_px; ++y) {
    const uchar* row = image.ptr<uchar>(v + y) + u;
    const uchar *above = image.ptr<uchar>(v + y - 1) + u, *below = image.ptr<uchar>(v + y + 1) + u;
    const double weight_y = Weights()[static_cast<size_t>(y + kCrossingRadius_px)];
    for (int x = -kCrossingRadius_px; x <= kCrossingRadius_px; ++x) {
      const double weight = weight_y * Weights()[static_cast<size_t>(x + kCrossingRadius_px)];
      const double gx = row[x + 1] - row[x - 1], gy = below[x] - above[x];
      const double along = weight * (gx * x + gy * y);
      xx += weight * gx * gx;
      xy += weight * gx * gy;
      yy += weight * gy * gy;
      sum += along * Vector2d(gx, gy);
    }
  }
  Eigen::Matrix2d normal;
  normal << xx, xy, xy, yy;
  return Vector2d(u, v) + normal.inverse() * sum;
}

}  // namespace

Eigen::Vector2d EdgeCrossing(const cv::Mat& image, const Vector2d& px) {
  constexpr int kMargin_px = kCrossingRadius_px + 1;
  Vector2d at = px;
  for (int i = 0; i < kMaxSteps; ++i) {
    const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
    if (u < kMargin_px || v < kMargin_px || u + kMargin_px >= image.cols ||
        v + kMargin_px >= image.rows) {
      return px;
    }
    const Vector2d next = CrossingAbout(image, u, v);
    if (!((next - px).norm() <= kCrossingMaxShift_px)) return px;  // nor where no edges cross: NaN
    const double step_px = (next - at).norm();
    at = next;
    if (step_px < kMinStep_px) break;
  }
  return at;
}

}  // namespace slcmap
