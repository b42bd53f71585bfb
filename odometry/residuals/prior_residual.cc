#include "odometry/residuals/prior_residual.h"

#include "odometry/residuals/block_manifold.h"

namespace slcmap {

int Prior::TangentOffset(int block) const {
  int offset = 0;
  for (int k = 0; k < block; ++k) offset += TangentSize(block_sizes[k]);
  return offset;
}

int Prior::TangentTotal() const { return TangentOffset(static_cast<int>(blocks.size())); }

Eigen::VectorXd Prior::Difference(const double* const* parameters) const {
  Eigen::VectorXd d(TangentTotal());
  int offset = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    const int size = block_sizes[k];
    BlockMinus(size, parameters[k], x_lin[k].data(), d.data() + offset);
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
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  int offset = 0;
  for (size_t k = 0; k < prior_->blocks.size(); ++k) {
    const int size = prior_->block_sizes[k], tangent = TangentSize(size);
    if (jacobians[k]) {
      const RowMajor columns = prior_->jacobian.middleCols(offset, tangent);
      JacobianByBlock(size, parameters[k], rows, columns.data(), jacobians[k]);
    }
    offset += tangent;
  }
  return true;
}

}  // namespace slcmap
