#include "odometry/frontend/row_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace slcmap {
namespace {

constexpr int kRadius_px = 5;
constexpr int kSide_px = 2 * kRadius_px + 1;
constexpr int kPixels = kSide_px * kSide_px;
constexpr int kMinVariance = 2;  // grey values squared

using Square = std::array<int16_t, kPixels>;

Square TakeSquare(const cv::Mat& image, int u, int v) {
  Square square;
  for (int y = 0; y < kSide_px; ++y) {
    const uchar* row = image.ptr<uchar>(v - kRadius_px + y) + u - kRadius_px;
    std::copy(row, row + kSide_px, square.begin() + y * kSide_px);
  }
  return square;
}

// Sums over two squares, kPixels times their (co)variance.
struct Sums {
  int64_t mean = 0;
  int64_t squares = 0;
};

Sums Accumulate(const Square& s) {
  int sum = 0, squares = 0;
  for (const int16_t x : s) {
    sum += x;
    squares += x * x;
  }
  return {sum, squares};
}

int64_t Product(const Square& a, const Square& b) {
  int product = 0;
  for (int i = 0; i < kPixels; ++i) product += a[i] * b[i];
  return product;
}

}  // namespace

std::optional<RowMatch> SearchRow(const cv::Mat& left, const cv::Mat& right,
                                  const Eigen::Vector2f& left_px, int max_disparity_px) {
  const int u = static_cast<int>(std::lround(left_px.x()));
  const int v = static_cast<int>(std::lround(left_px.y()));
  const int margin = kRadius_px + 1;
  if (u < margin || v < margin || u + margin >= left.cols || v + margin >= left.rows) {
    return std::nullopt;
  }
  const Square reference = TakeSquare(left, u, v);
  const Sums sums = Accumulate(reference);
  const int64_t variance = kPixels * sums.squares - sums.mean * sums.mean;
  if (variance < int64_t{kMinVariance} * kPixels * kPixels) return std::nullopt;
  RowMatch best;
  const int first = std::max(margin, u - max_disparity_px);
  for (int column = std::min(u + 1, right.cols - 1 - margin); column >= first; --column) {
    const Square candidate = TakeSquare(right, column, v);
    const Sums other = Accumulate(candidate);
    const int64_t other_variance = kPixels * other.squares - other.mean * other.mean;
    if (other_variance < int64_t{kMinVariance} * kPixels * kPixels) continue;
    const int64_t covariance = kPixels * Product(reference, candidate) - sums.mean * other.mean;
    const float correlation =
        static_cast<float>(covariance) /
        std::sqrt(static_cast<float>(variance) * static_cast<float>(other_variance));
    if (correlation > best.correlation) {
      best = {left_px + Eigen::Vector2f(column - u, 0), correlation};
    }
  }
  return best;
}

}  // namespace slcmap
