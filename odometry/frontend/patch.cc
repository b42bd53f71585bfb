#include "odometry/frontend/patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace slcmap::inline odometry {
namespace {

constexpr float kMinStandardDeviation = 0.7f;  // grey values; less is noise of the sensor
constexpr float kMinGain = 0.1f;
constexpr float kMaxShift_px = 12;  // at one level, from where the alignment started
// How far the affine part is expected to move per step, as noise in grey values over it.
constexpr float kAffineStiffness = 100.f;
constexpr float kMinEigenvalueRatio = 0.1f;  // of the two directions; an edge slides along itself

// Pixels sampled at once, in steps that the compiler turns into vector instructions.
constexpr int kBlock = 64;

struct Block {
  std::array<int, kBlock> index;              // of the top left one of four neighbours
  std::array<float, kBlock> x, y;             // from there, 0 to 1
  std::array<uchar, 2 * kBlock> top, bottom;  // the neighbours
};

void Locate(const float* offset_x, const float* offset_y, int count, const PatchWarp& warp,
            int stride, Block* block) {
  const float a = warp.affine(0, 0), b = warp.affine(0, 1), c = warp.affine(1, 0),
              d = warp.affine(1, 1);
  const float cx = warp.center_px.x(), cy = warp.center_px.y();
  for (int i = 0; i < count; ++i) {
    const float x = cx + a * offset_x[i] + b * offset_y[i];
    const float y = cy + c * offset_x[i] + d * offset_y[i];
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    block->x[i] = x - static_cast<float>(u);
    block->y[i] = y - static_cast<float>(v);
    block->index[i] = v * stride + u;
  }
}

void Fetch(const uchar* data, int stride, int count, Block* block) {
  for (int i = 0; i < count; ++i) {
    const uchar* p = data + block->index[i];
    std::memcpy(&block->top[2 * i], p, 2);
    std::memcpy(&block->bottom[2 * i], p + stride, 2);
  }
}

void Blend(const Block& block, int count, float* sampled) {
  for (int i = 0; i < count; ++i) {
    const float top_left = block.top[2 * i], top_right = block.top[2 * i + 1];
    const float bottom_left = block.bottom[2 * i], bottom_right = block.bottom[2 * i + 1];
    const float top = top_left + block.x[i] * (top_right - top_left);
    const float bottom = bottom_left + block.x[i] * (bottom_right - bottom_left);
    sampled[i] = top + block.y[i] * (bottom - top);
  }
}

// Samples the warped pattern bilinearly; false when any of it lies beyond the border.
bool Sample(const PatchPattern& pattern, const cv::Mat& image, const PatchWarp& warp,
            Eigen::VectorXf* sampled) {
  const float r = static_cast<float>(pattern.radius_px);
  const Eigen::Vector2f reach = warp.affine.cwiseAbs() * Eigen::Vector2f(r, r);
  const Eigen::Vector2f low = warp.center_px - reach, high = warp.center_px + reach;
  if (!(low.x() >= 0 && low.y() >= 0 && high.x() < static_cast<float>(image.cols - 1) &&
        high.y() < static_cast<float>(image.rows - 1))) {
    return false;
  }
  const int all = static_cast<int>(pattern.weights.size()), stride = static_cast<int>(image.step);
  sampled->resize(all);
  Block block;
  for (int first = 0; first < all; first += kBlock) {
    const int count = std::min(kBlock, all - first);
    Locate(pattern.x_px.data() + first, pattern.y_px.data() + first, count, warp, stride, &block);
    Fetch(image.data, stride, count, &block);
    Blend(block, count, sampled->data() + first);
  }
  return true;
}

}  // namespace

ImagePyramid BuildPyramid(const cv::Mat& image, int levels) {
  ImagePyramid pyramid{image};
  for (int i = 1; i < levels; ++i) {
    cv::Mat half;
    cv::pyrDown(pyramid.back(), half);
    pyramid.push_back(half);
  }
  return pyramid;
}

PatchPattern::PatchPattern(int diameter_px) : radius_px(diameter_px / 2) {
  const float radius = 0.5f * static_cast<float>(diameter_px);
  std::vector<Eigen::Vector2f> offsets;
  for (int y = -radius_px; y <= radius_px; ++y) {
    for (int x = -radius_px; x <= radius_px; ++x) {
      if (static_cast<float>(x * x + y * y) <= radius * radius) offsets.emplace_back(x, y);
    }
  }
  const Eigen::Map<const Eigen::Matrix2Xf> all(offsets[0].data(), 2, std::ssize(offsets));
  x_px = all.row(0);
  y_px = all.row(1);
  weights = (-all.colwise().squaredNorm() / (radius * radius)).array().exp();
  weights /= weights.sum();
}

bool Patch::Extract(const PatchPattern& pattern, const cv::Mat& image,
                    const Eigen::Vector2f& center_px, bool with_affine) {
  template_.resize(0);
  Eigen::VectorXf left, right, up, down, values;
  const auto at = [&](float x, float y, Eigen::VectorXf* out) {
    return Sample(pattern, image, {center_px + Eigen::Vector2f(x, y), Eigen::Matrix2f::Identity()},
                  out);
  };
  if (!at(0, 0, &values) || !at(-1, 0, &left) || !at(1, 0, &right) || !at(0, -1, &up) ||
      !at(0, 1, &down)) {
    return false;
  }
  values.array() -= pattern.weights.dot(values);
  norm_ = std::sqrt(pattern.weights.dot(values.cwiseAbs2()));
  if (norm_ < kMinStandardDeviation) return false;
  template_ = pattern.weights.cwiseProduct(values);
  PrepareSteps(pattern, 0.5f * (right - left), 0.5f * (down - up), with_affine);
  return !empty();
}

// With weights w, reference T of zero mean and Jacobian J, the step is H^-1 J^T w I / gain where J
// has the components along 1 and T removed: gain and offset of the image I do not act on it.
void Patch::PrepareSteps(const PatchPattern& pattern, const Eigen::VectorXf& gradient_x,
                         const Eigen::VectorXf& gradient_y, bool with_affine) {
  Eigen::MatrixXf J(gradient_x.size(), with_affine ? 6 : 2);
  J.col(0) = gradient_x;
  J.col(1) = gradient_y;
  if (with_affine) {
    J.col(2) = gradient_x.cwiseProduct(pattern.x_px);
    J.col(3) = gradient_x.cwiseProduct(pattern.y_px);
    J.col(4) = gradient_y.cwiseProduct(pattern.x_px);
    J.col(5) = gradient_y.cwiseProduct(pattern.y_px);
  }
  const Eigen::VectorXf reference = template_.cwiseQuotient(pattern.weights);
  for (auto column : J.colwise()) {
    const float mean = pattern.weights.dot(column);
    const float along = template_.dot(column) / (norm_ * norm_);
    column -= along * reference;
    column.array() -= mean;
  }
  const Eigen::MatrixXf weighted = pattern.weights.asDiagonal() * J;
  Eigen::MatrixXf H = weighted.transpose() * J;
  const Eigen::Matrix2f H_shift = H.topLeftCorner<2, 2>();
  // For the ratio q of the eigenvalues, det / trace^2 = q / (1 + q)^2.
  constexpr float kMinRoundness =
      kMinEigenvalueRatio / ((1 + kMinEigenvalueRatio) * (1 + kMinEigenvalueRatio));
  if (H_shift.determinant() < kMinRoundness * H_shift.trace() * H_shift.trace()) {
    template_.resize(0);
    return;
  }
  shift_steps_ = H_shift.inverse() * weighted.leftCols<2>().transpose();
  if (!with_affine) return;
  H.diagonal().tail<4>().array() += kAffineStiffness;
  affine_steps_ = H.ldlt().solve(weighted.transpose());
}

Patch::Match Patch::Compare(const PatchPattern& pattern, const Eigen::VectorXf& sampled) const {
  const float mean = pattern.weights.dot(sampled);
  const float squares = pattern.weights.dot(sampled.cwiseAbs2());
  const float product = template_.dot(sampled);
  const float variance = squares - mean * mean;
  if (variance < 0.01f) return {};
  return {product / (norm_ * norm_), product / (norm_ * std::sqrt(variance))};
}

float Patch::Correlation(const PatchPattern& pattern, const cv::Mat& image,
                         const PatchWarp& warp) const {
  Eigen::VectorXf sampled;
  if (!Sample(pattern, image, warp, &sampled)) return -1;
  return Compare(pattern, sampled).correlation;
}

float Patch::Align(const PatchPattern& pattern, const cv::Mat& image, int max_iterations,
                   float min_step_px, PatchWarp* warp) const {
  const Eigen::Vector2f start = warp->center_px;
  float correlation = -1;
  Eigen::VectorXf sampled;
  for (int i = 0; i < max_iterations; ++i) {
    if (!Sample(pattern, image, *warp, &sampled)) return -1;
    const Match match = Compare(pattern, sampled);
    if (match.gain < kMinGain) return -1;
    correlation = match.correlation;
    const Eigen::Vector2f step = warp->affine * (shift_steps_ * sampled) / match.gain;
    warp->center_px -= step;
    if ((warp->center_px - start).squaredNorm() > kMaxShift_px * kMaxShift_px) return -1;
    if (step.squaredNorm() < min_step_px * min_step_px) break;
  }
  return correlation;
}

float Patch::AlignAffine(const PatchPattern& pattern, const cv::Mat& image, int iterations,
                         PatchWarp* warp) const {
  float correlation = -1;
  Eigen::VectorXf sampled;
  for (int i = 0; i < iterations; ++i) {
    if (!Sample(pattern, image, *warp, &sampled)) return -1;
    const Match match = Compare(pattern, sampled);
    if (match.gain < kMinGain) return -1;
    correlation = match.correlation;
    const Eigen::Matrix<float, 6, 1> step = (affine_steps_ * sampled) / match.gain;
    Eigen::Matrix2f increment;
    increment << 1 + step[2], step[3], step[4], 1 + step[5];
    if (!(increment.determinant() > 0.3f)) return -1;
    warp->affine *= increment.inverse();
    warp->center_px -= warp->affine * step.head<2>();
  }
  return correlation;
}

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

}  // namespace slcmap::odometry
