// The terms that hold a point to the line it belongs to.
#pragma once

#include "odometry/geometry/general_line.h"
#include "odometry/geometry/structural_line.h"
#include "odometry/residuals/factor.h"
#include "odometry/residuals/point_residual.h"

namespace slcmap {

// Blocks: pose of the point's host, heading, structural line, point; for a vertical line without
// the heading. With the axes E across the line and z = (x, y, 1), in the host's left camera C:
//
//   p = R_h (R_IC z / lambda + p_IC) + p_h
//   r = ( (cos theta, sin theta) / rho - E^T (p - anchor) ) / sigma          (SLC-VIO, section 3.4)
//
// Two rows. A point or line farther than kMaxDistance_m gets constant rows: it lies behind the
// camera or at infinity.
class PointOnLineResidual final : public Factor {
 public:
  static constexpr double kMaxDistance_m = 1000;

  // The geometry must outlive the residual.
  PointOnLineResidual(const StereoGeometry* geometry, const StructuralLine& line, double sigma_m);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  StructuralLine line_;
  double weight_;
};

// The same for a line whose direction is estimated too. Blocks: pose of the point's host, general
// line, point. With the columns u of the line's rotation (see general_line.h) and q = p - anchor:
//
//   r = (u_0 . q, u_2 . q + cot phi) / sigma
//
// Two rows, which are constant as above.
class PointOnFreeLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  PointOnFreeLineResidual(const StereoGeometry* geometry, const Eigen::Vector3d& anchor_world,
                          double sigma_m);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  Eigen::Vector3d anchor_world_;
  double weight_;
};

}  // namespace slcmap
