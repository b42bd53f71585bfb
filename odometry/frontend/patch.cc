#include "odometry/frontend/patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

constexpr float kMinStandardDeviation = 0.7f;  // grey values; less is noise of the sensor
constexpr float kMinGain = 0.1f;
constexpr float kMaxShift_px = 12;  // at one level, from where the alignment started
// How far the affine part is expected to move per step, as noise in grey values over it.
constexpr float kAffineStiffness = 100.f;
constexpr float kMinEigenvalueRatio = 0.1f;  // of the two directions; an edge slides along itself

// Samples the warped pattern bilinearly; false when any of it lies beyond the border.
bool Sample(const PatchPattern& pattern, const cv::Mat& image, const PatchWarp& warp,
            std::vector<float>* sampled) {
  const float r = static_cast<float>(pattern.radius_px);
  const Eigen::Vector2f reach = warp.affine.cwiseAbs() * Eigen::Vector2f(r, r);
  const Eigen::Vector2f low = warp.center_px - reach, high = warp.center_px + reach;
  if (!(low.x() >= 0 && low.y() >= 0 && high.x() < image.cols - 1 && high.y() < image.rows - 1)) {
    return false;
  }
  const size_t count = pattern.offsets.size();
  sampled->resize(count);
  const uchar* const data = image.data;
  const int stride = static_cast<int>(image.step);
  const float a = warp.affine(0, 0), b = warp.affine(0, 1), c = warp.affine(1, 0),
              d = warp.affine(1, 1);
  const float cx = warp.center_px.x(), cy = warp.center_px.y();
  for (size_t i = 0; i < count; ++i) {
    const float ox = pattern.offsets[i].x(), oy = pattern.offsets[i].y();
    const float x = cx + a * ox + b * oy, y = cy + c * ox + d * oy;
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    const float fx = x - u, fy = y - v;
    const uchar* p = data + v * stride + u;
    const float top = p[0] + fx * (p[1] - p[0]);
    const float bottom = p[stride] + fx * (p[stride + 1] - p[stride]);
    (*sampled)[i] = top + fy * (bottom - top);
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
  const float radius = 0.5f * diameter_px;
  float sum = 0;
  for (int y = -radius_px; y <= radius_px; ++y) {
    for (int x = -radius_px; x <= radius_px; ++x) {
      const float r2 = static_cast<float>(x * x + y * y) / (radius * radius);
      if (r2 > 1) continue;
      offsets.emplace_back(x, y);
      weights.push_back(std::exp(-1.0f * r2));
      sum += weights.back();
    }
  }
  for (float& w : weights) w /= sum;
}

bool Patch::Extract(const PatchPattern& pattern, const cv::Mat& image,
                    const Eigen::Vector2f& center_px, bool with_affine) {
  template_.clear();
  const size_t count = pattern.offsets.size();
  std::vector<float> left, right, up, down, values;
  const auto at = [&](float x, float y, std::vector<float>* out) {
    return Sample(pattern, image, {center_px + Eigen::Vector2f(x, y), Eigen::Matrix2f::Identity()},
                  out);
  };
  if (!at(0, 0, &values) || !at(-1, 0, &left) || !at(1, 0, &right) || !at(0, -1, &up) ||
      !at(0, 1, &down)) {
    return false;
  }
  float mean = 0, squares = 0;
  std::vector<Eigen::Vector2f> gradients(count);
  for (size_t i = 0; i < count; ++i) {
    mean += pattern.weights[i] * values[i];
    gradients[i] = 0.5f * Eigen::Vector2f(right[i] - left[i], down[i] - up[i]);
  }
  for (size_t i = 0; i < count; ++i) {
    squares += pattern.weights[i] * (values[i] - mean) * (values[i] - mean);
  }
  norm_ = std::sqrt(squares);
  if (norm_ < kMinStandardDeviation) return false;
  template_.resize(count);
  for (size_t i = 0; i < count; ++i) template_[i] = pattern.weights[i] * (values[i] - mean);
  PrepareSteps(pattern, gradients, with_affine);
  return !template_.empty();
}

// With weights w, reference T of zero mean and Jacobian J, the step is H^-1 J^T w I / gain where J
// has the components along 1 and T removed: gain and offset of the image I do not act on it.
void Patch::PrepareSteps(const PatchPattern& pattern, const std::vector<Eigen::Vector2f>& gradients,
                         bool with_affine) {
  using Vector6 = Eigen::Matrix<float, 6, 1>;
  const size_t count = gradients.size();
  Eigen::Matrix<float, 6, Eigen::Dynamic> J(6, count);
  Vector6 mean = Vector6::Zero(), along = Vector6::Zero();
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector2f& g = gradients[i];
    const Eigen::Vector2f& o = pattern.offsets[i];
    J.col(i) << g.x(), g.y(), g.x() * o.x(), g.x() * o.y(), g.y() * o.x(), g.y() * o.y();
    mean += pattern.weights[i] * J.col(i);
    along += template_[i] * J.col(i);
  }
  along /= norm_ * norm_;
  Eigen::Matrix<float, 6, 6> H = Eigen::Matrix<float, 6, 6>::Zero();
  for (size_t i = 0; i < count; ++i) {
    J.col(i) -= mean + along * (template_[i] / pattern.weights[i]);
    H += pattern.weights[i] * J.col(i) * J.col(i).transpose();
    J.col(i) *= pattern.weights[i];
  }
  const Eigen::Matrix2f H_shift = H.topLeftCorner<2, 2>();
  // For the ratio q of the eigenvalues, det / trace^2 = q / (1 + q)^2.
  constexpr float kMinRoundness =
      kMinEigenvalueRatio / ((1 + kMinEigenvalueRatio) * (1 + kMinEigenvalueRatio));
  if (H_shift.determinant() < kMinRoundness * H_shift.trace() * H_shift.trace()) {
    template_.clear();
    return;
  }
  shift_steps_ = H_shift.inverse() * J.topRows<2>();
  if (!with_affine) return;
  H.diagonal().tail<4>().array() += kAffineStiffness;
  affine_steps_ = H.ldlt().solve(J);
}

Patch::Match Patch::Compare(const PatchPattern& pattern, const std::vector<float>& sampled) const {
  float mean = 0, squares = 0, product = 0;
  for (size_t i = 0; i < sampled.size(); ++i) {
    const float wi = pattern.weights[i] * sampled[i];
    mean += wi;
    squares += wi * sampled[i];
    product += template_[i] * sampled[i];
  }
  const float variance = squares - mean * mean;
  if (variance < 0.01f) return {};
  return {product / (norm_ * norm_), product / (norm_ * std::sqrt(variance))};
}

float Patch::Correlation(const PatchPattern& pattern, const cv::Mat& image,
                         const PatchWarp& warp) const {
  std::vector<float> sampled;
  if (!Sample(pattern, image, warp, &sampled)) return -1;
  return Compare(pattern, sampled).correlation;
}

float Patch::Align(const PatchPattern& pattern, const cv::Mat& image, int max_iterations,
                   float min_step_px, PatchWarp* warp) const {
  const Eigen::Vector2f start = warp->center_px;
  float correlation = -1;
  std::vector<float> sampled;
  for (int i = 0; i < max_iterations; ++i) {
    if (!Sample(pattern, image, *warp, &sampled)) return -1;
    const Match match = Compare(pattern, sampled);
    if (match.gain < kMinGain) return -1;
    correlation = match.correlation;
    const Eigen::Map<const Eigen::VectorXf> I(sampled.data(), sampled.size());
    const Eigen::Vector2f step = warp->affine * (shift_steps_ * I) / match.gain;
    warp->center_px -= step;
    if ((warp->center_px - start).squaredNorm() > kMaxShift_px * kMaxShift_px) return -1;
    if (step.squaredNorm() < min_step_px * min_step_px) break;
  }
  return correlation;
}

float Patch::AlignAffine(const PatchPattern& pattern, const cv::Mat& image, int iterations,
                         PatchWarp* warp) const {
  float correlation = -1;
  std::vector<float> sampled;
  for (int i = 0; i < iterations; ++i) {
    if (!Sample(pattern, image, *warp, &sampled)) return -1;
    const Match match = Compare(pattern, sampled);
    if (match.gain < kMinGain) return -1;
    correlation = match.correlation;
    const Eigen::Map<const Eigen::VectorXf> I(sampled.data(), sampled.size());
    const Eigen::Matrix<float, 6, 1> step = (affine_steps_ * I) / match.gain;
    Eigen::Matrix2f increment;
    increment << 1 + step[2], step[3], step[4], 1 + step[5];
    if (!(increment.determinant() > 0.3f)) return -1;
    warp->affine *= increment.inverse();
    warp->center_px -= warp->affine * step.head<2>();
  }
  return correlation;
}

}  // namespace slcmap
