// The term of what is taken to be as the given calibration has it.
#pragma once

#include <Eigen/Core>

#include "odometry/residuals/factor.h"

namespace slcmap {

// Block: a calibration block (see calibration.h), whose numbers are corrections of what was given.
// r = weights * x, a row a number; a weight is one over a standard deviation, or 0.
class AsGivenResidual final : public Factor {
 public:
  AsGivenResidual(const BlockKind& kind, const Eigen::VectorXd& weights);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  Eigen::VectorXd weights_;
};

}  // namespace slcmap
