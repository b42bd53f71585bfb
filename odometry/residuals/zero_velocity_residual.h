// The term of a state at which the rig was found to stand still.
#pragma once

#include "odometry/residuals/factor.h"

namespace slcmap {

// Block: speed-and-bias. r = v / sigma, three rows.
class ZeroVelocityResidual final : public Factor {
 public:
  explicit ZeroVelocityResidual(double sigma_m_s);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace slcmap
