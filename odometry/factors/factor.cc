#include "odometry/factors/factor.h"

#include <algorithm>
#include <utility>

namespace slcmap::inline odometry {
namespace {

constexpr int kMaxRows = 15;
constexpr int kMaxTangent = 9;

}  // namespace

Factor::Factor(int rows, const std::vector<BlockKind>& kinds) {
  set_num_residuals(rows);
  std::copy(kinds.begin(), kinds.end(), kinds_.begin());
  for (const BlockKind& kind : kinds) mutable_parameter_block_sizes()->push_back(kind.size);
}

void Factor::Linearize(const double* const* parameters, double* residuals,
                       double** jacobians) const {
  std::array<const double*, kMaxBlocks> at;
  bool moved = false;
  for (int k = 0; k < blocks(); ++k) {
    at[k] = linearization_[k] ? linearization_[k] : parameters[k];
    moved = moved || linearization_[k];
  }
  if (!jacobians || !moved) {
    EvaluateAt(parameters, residuals, jacobians);
    return;
  }
  std::array<double, kMaxRows> unused;
  EvaluateAt(at.data(), unused.data(), jacobians);
  EvaluateAt(parameters, residuals, nullptr);
}

bool Factor::Evaluate(const double* const* parameters, double* residuals,
                      double** jacobians) const {
  if (!jacobians) {
    EvaluateAt(parameters, residuals, nullptr);
    return true;
  }
  std::array<double, kMaxBlocks * kMaxRows * kMaxTangent> buffer;
  std::array<double*, kMaxBlocks> tangent{};
  for (int k = 0; k < blocks(); ++k) {
    if (!jacobians[k]) continue;
    tangent[k] = kinds_[k].manifold ? buffer.data() + k * kMaxRows * kMaxTangent : jacobians[k];
  }
  Linearize(parameters, residuals, tangent.data());
  for (int k = 0; k < blocks(); ++k) {
    if (tangent[k] == jacobians[k]) continue;
    JacobianByBlock(kinds_[k], parameters[k], rows(), tangent[k], jacobians[k]);
  }
  return true;
}

int Prior::TangentOffset(int block) const {
  int offset = 0;
  for (int k = 0; k < block; ++k) offset += kinds[k].tangent_size;
  return offset;
}

int Prior::TangentTotal() const { return TangentOffset(static_cast<int>(blocks.size())); }

Eigen::VectorXd Prior::Difference(const double* const* parameters) const {
  Eigen::VectorXd d(TangentTotal());
  int offset = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    BlockMinus(kinds[k], parameters[k], x_lin[k].data(), d.data() + offset);
    offset += kinds[k].tangent_size;
  }
  return d;
}

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

namespace {

std::vector<BlockKind> KindsWithReadout(const Factor& residual) {
  std::vector<BlockKind> kinds{kReadoutKind};
  for (int k = 0; k < residual.blocks(); ++k) kinds.push_back(residual.kind(k));
  return kinds;
}

}  // namespace

ByReadoutResidual::ByReadoutResidual(std::unique_ptr<Factor> residual, const VectorXd& by_readout,
                                     double at_s)
    : Factor(residual->rows(), KindsWithReadout(*residual)),
      residual_(std::move(residual)),
      by_readout_(by_readout),
      at_s_(at_s) {}

void ByReadoutResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  residual_->Linearize(parameters + 1, residuals, jacobians ? jacobians + 1 : nullptr);
  Map<VectorXd>(residuals, rows()) += (parameters[0][0] - at_s_) * by_readout_;
  if (jacobians && jacobians[0]) Map<VectorXd>(jacobians[0], rows()) = by_readout_;
}

ZeroVelocityResidual::ZeroVelocityResidual(double sigma_m_s)
    : Factor(3, {kSpeedBiasKind}), weight_(1.0 / sigma_m_s) {}

void ZeroVelocityResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                      double** jacobians) const {
  Eigen::Map<Eigen::Vector3d>{residuals} =
      weight_ * Eigen::Map<const Eigen::Vector3d>(parameters[0]);
  if (!jacobians || !jacobians[0]) return;
  Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> d(jacobians[0]);
  d.setZero();
  d.leftCols<3>() = weight_ * Eigen::Matrix3d::Identity();
}

}  // namespace slcmap::odometry
