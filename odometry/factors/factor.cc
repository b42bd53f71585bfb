#include "odometry/factors/factor.h"

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <utility>

namespace slcmap::inline odometry {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Map<Vector3d>{x_plus_delta} = Map<const Vector3d>(x) + Map<const Vector3d>(delta);
  Map<Quaterniond>{x_plus_delta + 3} =
      (Map<const Quaterniond>(x + 3) * ExpRotation(Map<const Vector3d>(delta + 3))).normalized();
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  // q (delta / 2, 1) to first order; its transpose is a quarter of the Jacobian of Minus.
  Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<3, 3>().setIdentity();
  j.bottomRightCorner<4, 3>() = 0.25 * RotationMinusJacobian(x + 3).transpose();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Map<Vector3d>{y_minus_x} = Map<const Vector3d>(y) - Map<const Vector3d>(x);
  Map<Vector3d>{y_minus_x + 3} =
      LogRotation(Map<const Quaterniond>(x + 3).conjugate() * Map<const Quaterniond>(y + 3));
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<3, 3>().setIdentity();
  j.bottomRightCorner<3, 4>() = RotationMinusJacobian(x + 3);
  return true;
}

Matrix34d RotationMinusJacobian(const double* quaternion) {
  const Map<const Quaterniond> q(quaternion);
  Matrix34d j;
  j.leftCols<3>() = 2.0 * (q.w() * Matrix3d::Identity() - Skew(q.vec()));
  j.rightCols<1>() = -2.0 * q.vec();
  return j;
}

RigidTransform PoseFromBlock(const double* pose) {
  return {Quaterniond(Map<const Quaterniond>(pose + 3)), Map<const Vector3d>(pose)};
}

void PoseToBlock(const RigidTransform& pose, double* block) {
  Map<Vector3d>{block} = pose.translation;
  Map<Quaterniond>{block + 3} = pose.rotation;
}

bool OrthonormalLineManifold::Plus(const double* x, const double* delta,
                                   double* x_plus_delta) const {
  Map<Quaterniond>{x_plus_delta} =
      (Map<const Quaterniond>(x) * ExpRotation(Map<const Vector3d>(delta))).normalized();
  x_plus_delta[4] = x[4] + delta[3];
  return true;
}

bool OrthonormalLineManifold::PlusJacobian(const double* x, double* jacobian) const {
  Map<Eigen::Matrix<double, 5, 4, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<4, 3>() = 0.25 * RotationMinusJacobian(x).transpose();
  j(4, 3) = 1;
  return true;
}

bool OrthonormalLineManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Map<Vector3d>{y_minus_x} =
      LogRotation(Map<const Quaterniond>(x).conjugate() * Map<const Quaterniond>(y));
  y_minus_x[3] = y[4] - x[4];
  return true;
}

bool OrthonormalLineManifold::MinusJacobian(const double* x, double* jacobian) const {
  Map<Eigen::Matrix<double, 4, 5, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<3, 4>() = RotationMinusJacobian(x);
  j(3, 4) = 1;
  return true;
}

ceres::Manifold* SharedPoseManifold() {
  static PoseManifold manifold;
  return &manifold;
}

ceres::Manifold* SharedLineManifold() {
  static OrthonormalLineManifold manifold;
  return &manifold;
}

void BlockPlus(const BlockKind& kind, const double* x, const double* delta, double* x_plus_delta) {
  if (kind.manifold) {
    kind.manifold()->Plus(x, delta, x_plus_delta);
  } else {
    std::transform(x, x + kind.size, delta, x_plus_delta, std::plus<>());
  }
}

void BlockMinus(const BlockKind& kind, const double* y, const double* x, double* y_minus_x) {
  if (kind.manifold) {
    kind.manifold()->Minus(y, x, y_minus_x);
  } else {
    std::transform(y, y + kind.size, x, y_minus_x, std::minus<>());
  }
}

void JacobianByBlock(const BlockKind& kind, const double* x, int rows, const double* by_tangent,
                     double* by_block) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (!kind.manifold) {
    std::copy_n(by_tangent, rows * kind.size, by_block);
    return;
  }
  RowMajor minus(kind.tangent_size, kind.size);
  kind.manifold()->MinusJacobian(x, minus.data());
  Eigen::Map<RowMajor>(by_block, rows, kind.size).noalias() =
      Eigen::Map<const RowMajor>(by_tangent, rows, kind.tangent_size).lazyProduct(minus);
}

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
