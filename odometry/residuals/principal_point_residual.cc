#include "odometry/residuals/principal_point_residual.h"

#include <algorithm>
#include <vector>

namespace slcmap {
namespace {

// Where the principal points stand among the blocks.
std::vector<BlockKind> KindsWith(const Factor& point) {
  std::vector<BlockKind> kinds;
  for (int k = 0; k < point.blocks(); ++k) kinds.push_back(point.kind(k));
  kinds.insert(kinds.end() - 1, kPrincipalPointKind);
  return kinds;
}

}  // namespace

PrincipalPointResidual::PrincipalPointResidual(std::unique_ptr<Factor> point, double weight,
                                               const std::array<Eigen::Matrix2d, 2>& by_pixel)
    : Factor(point->rows(), KindsWith(*point)), point_(std::move(point)) {
  by_principal_.setZero(rows(), kPrincipalPointSize);
  for (int camera = 0; camera < rows() / 2; ++camera) {
    by_principal_.block<2, 2>(2 * camera, 2 * camera) = weight * by_pixel[camera];
  }
}

void PrincipalPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                        double** jacobians) const {
  const int own = blocks() - 2;
  std::array<const double*, kMaxBlocks> of_point{};
  std::array<double*, kMaxBlocks> by_block{};
  for (int k = 0; k < point_->blocks(); ++k) {
    of_point[k] = parameters[k < own ? k : k + 1];
    if (jacobians) by_block[k] = jacobians[k < own ? k : k + 1];
  }
  point_->Linearize(of_point.data(), residuals, jacobians ? by_block.data() : nullptr);
  const Eigen::Map<const Eigen::Vector4d> principal(parameters[own]);
  Eigen::Map<Eigen::VectorXd>(residuals, rows()) += by_principal_ * principal;
  if (!jacobians || !jacobians[own]) return;
  std::copy_n(by_principal_.data(), by_principal_.size(), jacobians[own]);
}

}  // namespace slcmap
