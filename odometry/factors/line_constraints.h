// The terms that tie the directions of lines to an axis of a Manhattan world or to a shared slope,
// and those that hold a point to the line it belongs to.
#pragma once

#include "data/core/types.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/point_residual.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline odometry {

// Blocks: heading (but for a vertical line), shared deviation (where it has one), general line.
// With the axes E across the line's own (see odometry/geometry/lines.h), the line's unit direction
// d and the shared deviation c, two angles in rad,
//
//   r = (E^T d - c) / sigma
//
// Two rows. No building is exact: the deviation of a line from its axis is the same in all views of
// it, so it stands in the line's state and not in the noise of what is measured. Towards a sigma of
// zero the line is a structural one, towards a large one it is free. Walls lean and turn as a
// whole, and rooms with them: what lines share with their neighbours does not average out over
// these, and is a state of its own.
class AlongAxisResidual final : public Factor {
 public:
  // The axis is not kNone; sigma_rad is positive.
  AlongAxisResidual(LineAxis axis, double sigma_rad, bool shares = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  LineAxis axis_;
  bool shares_;
  double weight_;
};

// Block: shared deviation c. r = c / sigma, two rows.
class SharedDeviationResidual final : public Factor {
 public:
  explicit SharedDeviationResidual(double sigma_rad);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

// Blocks: slope, general line. As AlongAxisResidual, with the axes E across the slope and the
// line's unit direction d:
//
//   r = E^T d / sigma
class AlongSlopeResidual final : public Factor {
 public:
  // sigma_rad is positive.
  explicit AlongSlopeResidual(double sigma_rad);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

// Blocks: pose of the point's host, heading, structural line, point; for a vertical line without
// the heading. With the axes E across the line and z = (x, y, 1), in the host's camera C (see
// PointResidual):
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
  PointOnLineResidual(const StereoGeometry* geometry, const StructuralLine& line, double sigma_m,
                      int host_camera = 0);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  StructuralLine line_;
  double weight_;
  int host_camera_;
};

// The same for a line whose direction is estimated too. Blocks: pose of the point's host, general
// line, point. With the columns u of the line's rotation (see odometry/geometry/lines.h) and q = p
// - anchor:
//
//   r = (u_0 . q, u_2 . q + cot phi) / sigma
//
// Two rows, which are constant as above.
class PointOnFreeLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  PointOnFreeLineResidual(const StereoGeometry* geometry, const Eigen::Vector3d& anchor_world,
                          double sigma_m, int host_camera = 0);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  Eigen::Vector3d anchor_world_;
  double weight_;
  int host_camera_;
};

}  // namespace slcmap::odometry
