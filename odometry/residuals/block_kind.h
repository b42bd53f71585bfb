// What a parameter block is: how many numbers it has, how it moves, and whether it is eliminated.
#pragma once

#include <ceres/manifold.h>

#include "odometry/geometry/slope.h"
#include "odometry/geometry/structural_line.h"
#include "odometry/residuals/calibration.h"
#include "odometry/residuals/line_manifold.h"
#include "odometry/residuals/pose_manifold.h"

namespace slcmap {

ceres::Manifold* SharedPoseManifold();
ceres::Manifold* SharedLineManifold();  // of general lines

// Terms and the prior say of each block of which kind it is: nothing is concluded from its size.
struct BlockKind {
  int size = 0;          // numbers of the block
  int tangent_size = 0;  // freedoms
  // How tangents are added; null where as numbers are. Shared by all blocks: it has no state.
  ceres::Manifold* (*manifold)() = nullptr;
  // A point, which has three freedoms and is eliminated before all else: it may depend on any
  // state, but no term binds two, and a term binds it last.
  bool is_point = false;
  // A line, which no term binds with another line: where the prior does not bind it either, it is
  // eliminated early.
  bool is_line = false;
  bool is_calibration = false;  // of the rig: there as long as the window
};

inline constexpr int kPointSize = 3;            // see point_residual.h
inline constexpr int kSharedDeviationSize = 2;  // see along_axis_residual.h

inline constexpr BlockKind kPoseKind{kPoseSize, kPoseTangentSize, SharedPoseManifold};
inline constexpr BlockKind kSpeedBiasKind{kSpeedBiasSize, kSpeedBiasSize};
inline constexpr BlockKind kImuCalibrationKind{
    kImuCalibrationSize, kImuCalibrationSize, nullptr, false, false, true};
inline constexpr BlockKind kCameraCalibrationKind{
    kCameraCalibrationSize, kCameraCalibrationSize, nullptr, false, false, true};
inline constexpr BlockKind kHeadingKind{kHeadingSize, kHeadingSize};
inline constexpr BlockKind kSharedDeviationKind{kSharedDeviationSize, kSharedDeviationSize};
inline constexpr BlockKind kSlopeKind{kSlopeSize, kSlopeSize};
inline constexpr BlockKind kStructuralLineKind{kStructuralLineSize, kStructuralLineSize, nullptr,
                                               false, true};
inline constexpr BlockKind kGeneralLineKind{kGeneralLineSize, kGeneralLineTangentSize,
                                            SharedLineManifold, false, true};
inline constexpr BlockKind kPointKind{kPointSize, kPointSize, nullptr, true};

// The block at x, moved by a tangent vector.
void BlockPlus(const BlockKind& kind, const double* x, const double* delta, double* x_plus_delta);

// The tangent vector y minus x of two blocks of a kind.
void BlockMinus(const BlockKind& kind, const double* y, const double* x, double* y_minus_x);

// A residual's Jacobian by the numbers of the block at x, from that by its tangent. Both are
// row-major, rows x kind.tangent_size and rows x kind.size.
void JacobianByBlock(const BlockKind& kind, const double* x, int rows, const double* by_tangent,
                     double* by_block);

}  // namespace slcmap
