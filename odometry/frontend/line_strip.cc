#include "odometry/frontend/line_strip.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "odometry/frontend/line_geometry.h"

namespace slcmap {
namespace {

constexpr int kWidth = 2 * kProfileReach_px + 1;
constexpr int kSide = kProfileReach_px + 3;  // one side, with the edge itself
constexpr int kRows = 12;

// A column of it is a row of the strip.
using Strip = Eigen::Matrix<float, kWidth, kRows>;

float SampleStrip(const cv::Mat& image, float x, float y) {
  x = std::clamp(x, 0.f, image.cols - 1.01f);
  y = std::clamp(y, 0.f, image.rows - 1.01f);
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const float a = x - u, b = y - v;
  const uchar* top = image.ptr<uchar>(v) + u;
  const uchar* bottom = image.ptr<uchar>(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

// Calls take(i, r, value) for each sample i of each row r.
template <typename Take>
void SampleRows(const cv::Mat& image, const LineSegment& segment, const Eigen::Vector2d& across,
                int reach_px, Take take) {
  const Eigen::Vector2f step = across.cast<float>();
  for (int r = 0; r < kRows; ++r) {
    const Eigen::Vector2d center =
        segment.start + (r + 0.5) / kRows * (segment.end - segment.start);
    Eigen::Vector2f p = (center - reach_px * across).cast<float>();
    for (int i = 0; i <= 2 * reach_px; ++i, p += step) take(i, r, SampleStrip(image, p.x(), p.y()));
  }
}

template <typename A, typename B>
double Correlation(const A& a, const B& b) {
  const float mean_a = a.mean(), mean_b = b.mean();
  const float ab = ((a.array() - mean_a) * (b.array() - mean_b)).sum();
  const float norm =
      std::sqrt((a.array() - mean_a).square().sum() * (b.array() - mean_b).square().sum());
  return norm < 1e-3f ? -1 : ab / norm;
}

template <typename A, typename B>
double BestCorrelation(const A& a, const B& b) {
  return std::max({Correlation(a, b),
                   Correlation(a.template topRows<kSide>(), b.template topRows<kSide>()),
                   Correlation(a.template bottomRows<kSide>(), b.template bottomRows<kSide>())});
}

}  // namespace

Eigen::VectorXf MeanProfile(const cv::Mat& image, const LineSegment& segment, int reach_px) {
  Eigen::VectorXf profile = Eigen::VectorXf::Zero(2 * reach_px + 1);
  SampleRows(image, segment, Normal(segment), reach_px,
             [&](int i, int, float value) { profile[i] += value / kRows; });
  return profile;
}

double ProfileCorrelation(const Eigen::VectorXf& a, const Eigen::VectorXf& b) {
  return BestCorrelation(a, b);
}

double StripCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                        const LineSegment& b, const Eigen::Vector2d& across) {
  Strip strip_a, strip_b;
  SampleRows(image_a, a, across, kProfileReach_px,
             [&](int i, int r, float v) { strip_a(i, r) = v; });
  SampleRows(image_b, b, across, kProfileReach_px,
             [&](int i, int r, float v) { strip_b(i, r) = v; });
  return BestCorrelation(strip_a, strip_b);
}

}  // namespace slcmap
