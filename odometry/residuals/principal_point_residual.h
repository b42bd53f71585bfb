// What the principal points of the cameras change in the terms of points.
#pragma once

#include <array>
#include <memory>

#include "odometry/residuals/point_residual.h"

namespace slcmap {

// A principal point block is (cx, cy of the left, cx, cy of the right camera) in px of the given
// images, as the true ones less those that were given. Perturbed by addition.
inline constexpr int kPrincipalPointSize = 4;
inline constexpr BlockKind kPrincipalPointKind{
    kPrincipalPointSize, kPrincipalPointSize, nullptr, false, false, true};

// The residual of a point (PointResidual or HostPointResidual) where the principal points are
// unknown too: a camera whose principal point is off by d saw what it measured at m in truth at
//
//   m - H d
//
// with H of PlaneByPixel() there. Blocks: those of the point's residual, with the principal points
// before the last.
class PrincipalPointResidual final : public Factor {
 public:
  // `by_pixel` of the left camera, and of the right one where the residual has rows of it; `weight`
  // as in StereoGeometry.
  PrincipalPointResidual(std::unique_ptr<Factor> point, double weight,
                         const std::array<Eigen::Matrix2d, 2>& by_pixel);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  std::unique_ptr<Factor> point_;
  Eigen::Matrix<double, Eigen::Dynamic, kPrincipalPointSize, Eigen::RowMajor, 4> by_principal_;
};

}  // namespace slcmap
