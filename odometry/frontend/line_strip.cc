#include "odometry/frontend/line_strip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "odometry/frontend/line_geometry.h"

namespace slcmap {
namespace {

constexpr int kReach = 10;     // of a strip to either side, px
constexpr int kOtherSide = 2;  // px beyond the edge that a side alone includes
constexpr int kWidth = 2 * kReach + 1;
constexpr int kRows = 12;

using Strip = Eigen::Matrix<float, kWidth, kRows>;  // a column of it is a row of the strip

float Sample(const cv::Mat& image, const Eigen::Vector2d& p) {
  const double x = std::clamp(p.x(), 0.0, image.cols - 1.001);
  const double y = std::clamp(p.y(), 0.0, image.rows - 1.001);
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const float a = static_cast<float>(x - u), b = static_cast<float>(y - v);
  const uchar* top = image.ptr<uchar>(v) + u;
  const uchar* bottom = image.ptr<uchar>(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

Strip SampleStrip(const cv::Mat& image, const LineSegment& segment, const Eigen::Vector2d& across) {
  Strip strip;
  for (int r = 0; r < kRows; ++r) {
    const Eigen::Vector2d center =
        segment.start + (r + 0.5) / kRows * (segment.end - segment.start);
    for (int i = 0; i < kWidth; ++i) strip(i, r) = Sample(image, center + (i - kReach) * across);
  }
  return strip;
}

template <typename A, typename B>
double Correlation(const A& a, const B& b) {
  const auto da = (a.array() - a.mean()).eval(), db = (b.array() - b.mean()).eval();
  const double norm = std::sqrt(static_cast<double>(da.square().sum()) * db.square().sum());
  return norm < 1e-3 ? -1 : (da * db).sum() / norm;
}

double BestCorrelation(const Strip& a, const Strip& b) {
  constexpr int kSide = kReach + 1 + kOtherSide;
  return std::max({Correlation(a, b), Correlation(a.topRows<kSide>(), b.topRows<kSide>()),
                   Correlation(a.bottomRows<kSide>(), b.bottomRows<kSide>())});
}

}  // namespace

double StripCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                        const LineSegment& b, const Eigen::Vector2d& across) {
  return BestCorrelation(SampleStrip(image_a, a, across), SampleStrip(image_b, b, across));
}

double ProfileCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                          const LineSegment& b) {
  const Eigen::VectorXf p = SampleStrip(image_a, a, Normal(a)).rowwise().mean();
  const Eigen::VectorXf q = SampleStrip(image_b, b, Normal(b)).rowwise().mean();
  return Correlation(p, q);
}

}  // namespace slcmap
