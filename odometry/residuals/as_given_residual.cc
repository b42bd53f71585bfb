#include "odometry/residuals/as_given_residual.h"

namespace slcmap {

using Eigen::Map;
using Eigen::VectorXd;

AsGivenResidual::AsGivenResidual(const BlockKind& kind, const VectorXd& weights)
    : Factor(kind.size, {kind}), weights_(weights) {}

void AsGivenResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                 double** jacobians) const {
  const Eigen::Index size = weights_.size();
  Map<VectorXd>(residuals, size) = weights_.cwiseProduct(Map<const VectorXd>(parameters[0], size));
  if (!jacobians || !jacobians[0]) return;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Map<RowMajor>(jacobians[0], size, size) = weights_.asDiagonal();
}

}  // namespace slcmap
