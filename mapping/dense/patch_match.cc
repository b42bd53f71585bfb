#include "mapping/dense/patch_match.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace slcmap {
namespace {

// Smoothed images still have noise and rounding.
constexpr float kMinVariance = 0.15F;  // of residuals, grey values squared
// Smoothing makes the residuals of taps depend on each other, and surfaces are not quite planes:
// with this share about two thirds of simulated depths are within one sigma.
constexpr float kIndependentShare = 0.12F;
constexpr float kMinContrast = 0.6F, kMaxContrast = 1.6F;  // between two images of one patch

// Where the taps are from the middle of the patch; those beyond them are there.
struct TapPlaces {
  Taps x = Taps::Zero(), y = Taps::Zero(), is_tap = Taps::Zero();

  TapPlaces() {
    for (int tap = 0; tap < kPatchTaps; ++tap) {
      x[tap] = static_cast<float>(tap % (2 * kPatchRadius + 1) - kPatchRadius);
      y[tap] = static_cast<float>(tap / (2 * kPatchRadius + 1) - kPatchRadius);
      is_tap[tap] = 1;
    }
  }
};

const TapPlaces& Places() {
  static const TapPlaces places;
  return places;
}

// Zero beyond the taps.
void RemoveMean(Taps* values) {
  *values *= Places().is_tap;
  *values = (*values - values->sum() / kPatchTaps) * Places().is_tap;
}

// Grey values in the neighbour, and how they change with inverse depth.
struct WarpedPatch {
  Taps values, slopes;
  float pixels_per_unit = 0;
  bool is_inside = false;
};

// The grey values around places in an image.
struct Corners {
  Taps top_left, top_right, bottom_left, bottom_right;
};

// Places in an image, all inside, with how far they move with inverse depth.
struct TapPixels {
  Taps u, v, du, dv;
};

// Bilinear values, and derivatives along (du, dv).
void Sample(const cv::Mat& image, const TapPixels& at, WarpedPatch* patch) {
  const Eigen::Array<int, kPatchLanes, 1> columns = at.u.cast<int>(), rows = at.v.cast<int>();
  const float* pixels = image.ptr<float>();
  const auto stride = static_cast<std::ptrdiff_t>(image.step1());
  Corners c;
  for (int tap = 0; tap < kPatchLanes; ++tap) {
    const float* top = pixels + rows[tap] * stride + columns[tap];
    c.top_left[tap] = top[0];
    c.top_right[tap] = top[1];
    c.bottom_left[tap] = top[stride];
    c.bottom_right[tap] = top[stride + 1];
  }
  const Taps x = at.u - columns.cast<float>(), y = at.v - rows.cast<float>();
  const Taps across_top = c.top_right - c.top_left, across_bottom = c.bottom_right - c.bottom_left;
  const Taps upper = c.top_left + x * across_top;
  const Taps down = c.bottom_left + x * across_bottom - upper;
  patch->values = upper + y * down;
  patch->slopes = at.du * (across_top + y * (across_bottom - across_top)) + at.dv * down;
}

WarpedPatch Warp(int u, int v, const DepthNode& node, const PlaneWarp& warp, const cv::Mat& image) {
  constexpr float kMinDepth = 1e-6F;  // homogeneous: behind the camera it is below 0
  constexpr int kMiddle = kPatchTaps / 2;
  WarpedPatch patch;
  const Eigen::Vector3f centre =
      warp.A * Eigen::Vector3f(static_cast<float>(u), static_cast<float>(v), 1) +
      node.inverse_depth * warp.b;
  const Eigen::Vector3f along_x = kPatchSpacing_px * (warp.A.col(0) + node.slope_x * warp.b);
  const Eigen::Vector3f along_y = kPatchSpacing_px * (warp.A.col(1) + node.slope_y * warp.b);
  const TapPlaces& places = Places();
  const Taps depth = centre.z() + places.x * along_x.z() + places.y * along_y.z();
  if (!(depth.minCoeff() > kMinDepth)) return patch;
  const Taps inverse = depth.inverse();
  TapPixels at;
  at.u = (centre.x() + places.x * along_x.x() + places.y * along_y.x()) * inverse;
  at.v = (centre.y() + places.x * along_x.y() + places.y * along_y.y()) * inverse;
  const float last_column = static_cast<float>(image.cols - 1) - 1e-3F;
  const float last_row = static_cast<float>(image.rows - 1) - 1e-3F;
  patch.is_inside = at.u.minCoeff() >= 0 && at.v.minCoeff() >= 0 && at.u.maxCoeff() < last_column &&
                    at.v.maxCoeff() < last_row;
  if (!patch.is_inside) return patch;
  at.du = (warp.b.x() - at.u * warp.b.z()) * inverse;
  at.dv = (warp.b.y() - at.v * warp.b.z()) * inverse;
  patch.pixels_per_unit = std::hypot(at.du[kMiddle], at.dv[kMiddle]);
  Sample(image, at, &patch);
  return patch;
}

}  // namespace

ReferencePatch PatchAt(const cv::Mat& image, int u, int v) {
  ReferencePatch patch;
  patch.values.setZero();
  int tap = 0;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    const float* row = image.ptr<float>(v + y * kPatchSpacing_px) + u;
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
      patch.values[tap++] = row[x * kPatchSpacing_px];
    }
  }
  RemoveMean(&patch.values);
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
  RemoveMean(&warped.values);
  RemoveMean(&warped.slopes);
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
