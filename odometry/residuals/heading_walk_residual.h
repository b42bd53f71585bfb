// The term between the headings of neighbouring parts of a building.
#pragma once

#include "odometry/residuals/factor.h"

namespace slcmap {

// Blocks: heading before, heading after. r = (after - before) / sigma, one row. Walls that stand
// near each other deviate alike, which no number of them averages out: what lines behind say of the
// heading fades with the way.
class HeadingWalkResidual final : public Factor {
 public:
  explicit HeadingWalkResidual(double sigma_rad)
      : Factor(1, {kHeadingKind, kHeadingKind}), weight_(1.0 / sigma_rad) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    residuals[0] = weight_ * (parameters[1][0] - parameters[0][0]);
    if (!jacobians) return;
    if (jacobians[0]) *jacobians[0] = -weight_;
    if (jacobians[1]) *jacobians[1] = weight_;
  }

 private:
  double weight_;
};

}  // namespace slcmap
