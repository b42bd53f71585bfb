// The terms that hold what no measurement tells (position and heading of a first pose, how far away
// a line is), and lines together that are one edge, seen at two visits.
#pragma once

#include "mapping/adjustment/adjustment_state.h"
#include "odometry/factors/factor.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {

// Block: pose. With the given pose (R_0, p_0), rows
//
//   (p - p_0) / 1 mm      z . Log(R R_0^T) / 0.1 mrad
//
// A solution leaves them at zero, since nothing speaks against them.
class FirstPoseResidual final : public Factor {
 public:
  explicit FirstPoseResidual(const RigidTransform& T_world_imu);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  RigidTransform T_world_imu_;
};

// The term that holds how far away a line is, where no measurement tells.

// Block: a structural or a general line. With its last number x, the inverse distance from the
// anchor (1 / m) or an angle that is about that (rad), and x_0, which it has when the term is made,
//
//   r = (x - x_0) / sigma
class LineDistanceResidual final : public Factor {
 public:
  // sigma is positive.
  LineDistanceResidual(const BlockKind& kind, const double* block, double sigma);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const int last_;  // number of the block
  const double given_, weight_;
};

// Blocks: heading (but for vertical lines), structural line, structural line of one axis. With the
// axes E across it and the lines' points P where they cross the planes through their anchors:
//
//   r = E^T (P_1 - P_2) / sigma
//
// Two rows.
class SameStructuralEdgeResidual final : public Factor {
 public:
  SameStructuralEdgeResidual(LineAxis axis, const Eigen::Vector3d& first_anchor_world,
                             const Eigen::Vector3d& second_anchor_world, double sigma_m);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  LineAxis axis_;
  Eigen::Vector3d between_anchors_;  // from the second to the first
  double weight_;
};

// The same of lines whose directions are estimated. Blocks: general line, general line. The lines'
// points P are those that lie so far along each from the point nearest to its anchor, and E is
// held: it is that of the first line when the residual was made.
class SameFreeEdgeResidual final : public Factor {
 public:
  struct End {
    Eigen::Vector3d anchor_world;
    double along_m = 0;
  };
  SameFreeEdgeResidual(const End& first, const End& second, const Matrix32d& across,
                       double sigma_m);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  End ends_[2];
  Matrix32d across_;
  double weight_;
};

// Blocks: pose of the point's host (R, p), shift, point (x, y, lambda). With the point in the
// world, P = R (R_IC (x, y, 1) / lambda + p_IC) + p, and where it was measured, C:
//
//   r = ( Rz(psi) P + s - C ) / sigma
//
// Three rows.
class MeasuredPointResidual final : public Factor {
 public:
  MeasuredPointResidual(const RigidTransform& T_imu_camera, const ControlTie& tie)
      : Factor(3, {kPoseKind, kControlShiftKind, kPointKind}),
        T_imu_camera_(T_imu_camera),
        p_measured_(tie.p_world),
        weights_(tie.sigma_m.cwiseInverse()) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const RigidTransform T_imu_camera_;
  const Eigen::Vector3d p_measured_, weights_;
};

// Blocks: point and point, and the poses of their hosts, which two of one host do without. With the
// points in the world, P, as above, and their known distance d:
//
//   r = (|P_1 - P_2| - d) / sigma
class KnownDistanceResidual final : public Factor {
 public:
  KnownDistanceResidual(const RigidTransform& T_imu_camera, const DistanceTie& tie, bool one_host);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const RigidTransform T_imu_camera_;
  const double metres_, weight_;
  const bool one_host_;
};

}  // namespace slcmap::mapping
