// The term that holds a point to the structural line it belongs to.
#pragma once

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

}  // namespace slcmap
