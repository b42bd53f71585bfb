#include "mapping/adjustment/line_distance_residual.h"

namespace slcmap {

LineDistanceResidual::LineDistanceResidual(const BlockKind& kind, const double* block, double sigma)
    : Factor(1, {kind}), last_(kind.size - 1), given_(block[last_]), weight_(1 / sigma) {}

void LineDistanceResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                      double** jacobians) const {
  residuals[0] = weight_ * (parameters[0][last_] - given_);
  if (!jacobians || !jacobians[0]) return;
  Eigen::Map<Eigen::RowVectorXd> by_line(jacobians[0], tangent_size(0));
  by_line.setZero();
  by_line[tangent_size(0) - 1] = weight_;
}

}  // namespace slcmap
