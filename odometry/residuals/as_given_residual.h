// The term of what is taken to be as it is given, as by a calibration.
#pragma once

#include <Eigen/Core>

#include "odometry/residuals/factor.h"

namespace slcmap {

// Block: any whose tangents are added as numbers are, such as a calibration block (see
// calibration.h), whose numbers are corrections of what was given, so that 0 is as given.
// r = weights * (x - given), a row a number; a weight is one over a standard deviation, or 0.
class AsGivenResidual final : public Factor {
 public:
  AsGivenResidual(const BlockKind& kind, const Eigen::VectorXd& weights);
  AsGivenResidual(const BlockKind& kind, const Eigen::VectorXd& weights,
                  const Eigen::VectorXd& given);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  Eigen::VectorXd weights_, given_;
};

}  // namespace slcmap
