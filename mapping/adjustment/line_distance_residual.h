// The term that holds how far away a line is, where no measurement tells.
#pragma once

#include "odometry/residuals/factor.h"

namespace slcmap {

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

}  // namespace slcmap
