// The term that holds two lines together that are one edge, seen at two visits.
#pragma once

#include "odometry/geometry/structural_line.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

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

}  // namespace slcmap
