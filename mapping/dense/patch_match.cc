#include "mapping/dense/patch_match.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

// Smoothed images still have noise and rounding.
constexpr float kMinVariance = 0.15F;  // of residuals, grey values squared
// Smoothing makes the residuals of taps depend on each other, and surfaces are not quite planes:
// with this share about two thirds of simulated depths are within one sigma.
constexpr float kIndependentShare = 0.12F;
constexpr float kMinContrast = 0.6F, kMaxContrast = 1.6F;  // between two images of one patch

// Grey values in the neighbour, and how they change with inverse depth.
struct WarpedPatch {
  Taps values, slopes;
  float pixels_per_unit = 0;
  bool is_inside = true;
};

// Bilinear value and derivative along (du, dv). The pixel is inside.
inline void Sample(const cv::Mat& image, float u, float v, float du, float dv, float* value,
                   float* slope) {
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const float x = u - static_cast<float>(column), y = v - static_cast<float>(row);
  const float* top = image.ptr<float>(row) + column;
  const float* bottom = top + image.step1();
  const float across_top = top[1] - top[0], across_bottom = bottom[1] - bottom[0];
  const float upper = top[0] + x * across_top, lower = bottom[0] + x * across_bottom;
  *value = upper + y * (lower - upper);
  *slope = du * (across_top + y * (across_bottom - across_top)) + dv * (lower - upper);
}

WarpedPatch Warp(int u, int v, const DepthNode& node, const PlaneWarp& warp, const cv::Mat& image) {
  WarpedPatch patch;
  const Eigen::Vector3f centre =
      warp.A * Eigen::Vector3f(static_cast<float>(u), static_cast<float>(v), 1) +
      node.inverse_depth * warp.b;
  const Eigen::Vector3f along_x = kPatchSpacing_px * (warp.A.col(0) + node.slope_x * warp.b);
  const Eigen::Vector3f along_y = kPatchSpacing_px * (warp.A.col(1) + node.slope_y * warp.b);
  const float last_column = static_cast<float>(image.cols - 1) - 1e-3F;
  const float last_row = static_cast<float>(image.rows - 1) - 1e-3F;
  int tap = 0;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    Eigen::Vector3f h = centre + static_cast<float>(y) * along_y - float{kPatchRadius} * along_x;
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x, ++tap, h += along_x) {
      const float inverse = 1 / h.z();
      const float at_u = h.x() * inverse, at_v = h.y() * inverse;
      if (!(h.z() > 0 && at_u >= 0 && at_v >= 0 && at_u < last_column && at_v < last_row)) {
        patch.is_inside = false;
        return patch;
      }
      const float du = (warp.b.x() - at_u * warp.b.z()) * inverse;
      const float dv = (warp.b.y() - at_v * warp.b.z()) * inverse;
      Sample(image, at_u, at_v, du, dv, &patch.values[tap], &patch.slopes[tap]);
      if (x == 0 && y == 0) patch.pixels_per_unit = std::hypot(du, dv);
    }
  }
  return patch;
}

}  // namespace

ReferencePatch PatchAt(const cv::Mat& image, int u, int v) {
  ReferencePatch patch;
  int tap = 0;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    const float* row = image.ptr<float>(v + y * kPatchSpacing_px) + u;
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
      patch.values[tap++] = row[x * kPatchSpacing_px];
    }
  }
  patch.values -= patch.values.mean();
  patch.energy = patch.values.square().sum();
  return patch;
}

PlaneWarp::PlaneWarp(const Camera& camera, const RigidTransform& T_neighbour_reference) {
  Eigen::Matrix3d K;
  K << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1;
  A = (K * T_neighbour_reference.rotation.toRotationMatrix() * K.inverse()).cast<float>();
  b = (K * T_neighbour_reference.translation).cast<float>();
}

PatchComparison ComparePatch(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                             const PlaneWarp& warp, const cv::Mat& neighbour) {
  PatchComparison comparison;
  WarpedPatch warped = Warp(u, v, node, warp, neighbour);
  if (!warped.is_inside) return comparison;
  comparison.is_inside = true;
  comparison.pixels_per_unit = warped.pixels_per_unit;
  warped.values -= warped.values.mean();
  warped.slopes -= warped.slopes.mean();
  const float energy = warped.values.square().sum();
  const float product = (warped.values * patch.values).sum();
  comparison.correlation = product / std::sqrt(std::max(energy * patch.energy, 1e-6F));
  const float contrast =
      std::clamp(product / std::max(patch.energy, 1e-6F), kMinContrast, kMaxContrast);
  const Taps residuals = warped.values - contrast * patch.values;
  const float steepness = warped.slopes.square().sum();
  if (steepness <= 0) return comparison;
  const float moved = (warped.slopes * residuals).sum();
  comparison.step = -moved / steepness;
  // What the step takes away of the residuals is not noise.
  const float left = residuals.square().sum() - moved * moved / steepness;
  const float variance = std::max(left / (kPatchTaps - 3), kMinVariance);
  comparison.information = kIndependentShare * steepness / variance;
  return comparison;
}

}  // namespace slcmap
