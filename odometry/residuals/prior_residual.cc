#include "odometry/residuals/prior_residual.h"

#include "odometry/residuals/factor.h"

namespace slcmap {

int Prior::TangentOffset(int block) const {
  int offset = 0;
  for (int k = 0; k < block; ++k) offset += TangentSize(block_sizes[k]);
  return offset;
}

int Prior::TangentTotal() const { return TangentOffset(static_cast<int>(blocks.size())); }

Eigen::VectorXd Prior::Difference(const double* const* parameters) const {
  const PoseManifold manifold;
  Eigen::VectorXd d(TangentTotal());
  int offset = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    const int size = block_sizes[k];
    if (size == kPoseSize) {
      manifold.Minus(parameters[k], x_lin[k].data(), d.data() + offset);
    } else {
      d.segment(offset, size) = Eigen::Map<const Eigen::VectorXd>(parameters[k], size) -
                                Eigen::Map<const Eigen::VectorXd>(x_lin[k].data(), size);
    }
    offset += TangentSize(size);
  }
  return d;
}

PriorResidual::PriorResidual(const Prior* prior) : prior_(prior) {
  set_num_residuals(static_cast<int>(prior->residual.size()));
  *mutable_parameter_block_sizes() = prior->block_sizes;
}

bool PriorResidual::Evaluate(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const int rows = num_residuals();
  Eigen::Map<Eigen::VectorXd>(residuals, rows) =
      prior_->residual + prior_->jacobian * prior_->Difference(parameters);
  if (!jacobians) return true;
  int offset = 0;
  for (size_t k = 0; k < prior_->blocks.size(); ++k) {
    const int size = prior_->block_sizes[k], tangent = TangentSize(size);
    if (jacobians[k]) {
      using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<Matrix> d(jacobians[k], rows, size);
      const auto columns = prior_->jacobian.middleCols(offset, tangent);
      if (size == kPoseSize) {
        d.noalias() = columns * PoseMinusJacobian(parameters[k]);
      } else {
        d = columns;
      }
    }
    offset += tangent;
  }
  return true;
}

}  // namespace slcmap
