// One patch of a reference image in a neighbour's: how alike they are, and which way is better.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "data/types.h"
#include "mapping/dense/depth_grid.h"

namespace slcmap {

inline constexpr int kPatchRadius = 3, kPatchSpacing_px = 2;  // taps of a patch, on either side
inline constexpr int kPatchTaps = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
inline constexpr int kPatchMargin_px = kPatchRadius * kPatchSpacing_px;

// Whole registers of four: what is beyond the taps is zero, or means nothing.
inline constexpr int kPatchLanes = (kPatchTaps + 3) / 4 * 4;
using Taps = Eigen::Array<float, kPatchLanes, 1>;

// The patch of a reference image around a pixel, without its mean.
struct ReferencePatch {
  Taps values;
  float energy = 0;  // sum of squares
};

// The pixel is at least kPatchMargin_px inside the image (float).
ReferencePatch PatchAt(const cv::Mat& image, int u, int v);

// A neighbour relative to the reference, in the pixels of the camera that both are.
struct PlaneWarp {
  PlaneWarp(const Camera& camera, const RigidTransform& T_neighbour_reference);
  // Homogeneous pixel in the neighbour: A (u, v, 1) + b inverse_depth.
  Eigen::Matrix3f A;
  Eigen::Vector3f b;
};

struct PatchComparison {
  bool is_inside = false;     // all taps lie in the neighbour's image
  float correlation = 0;      // normalised, zero mean
  float step = 0;             // of inverse depth, to the best agreement by first order
  float information = 0;      // of that step, 1/variance, by the residuals that are left
  float pixels_per_unit = 0;  // how fast the patch moves with inverse depth
};

// Compares a patch, mapped by the plane of its node, with the neighbour's image (float).
PatchComparison ComparePatch(const ReferencePatch& patch, int u, int v, const DepthNode& node,
                             const PlaneWarp& warp, const cv::Mat& neighbour);

}  // namespace slcmap
