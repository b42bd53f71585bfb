#include "odometry/residuals/imu_residual.h"

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Jacobian6 = Eigen::Matrix<double, 15, 6, Eigen::RowMajor>;
using Jacobian9 = Eigen::Matrix<double, 15, 9, Eigen::RowMajor>;

const Vector3d kGravity(0, 0, -kGravity_m_s2);

struct State {
  explicit State(const double* pose, const double* speed_bias)
      : p(pose), q(pose + 3), v(speed_bias), bg(speed_bias + 3), ba(speed_bias + 6) {}
  Map<const Vector3d> p;
  Map<const Quaterniond> q;
  Map<const Vector3d> v, bg, ba;
};

}  // namespace

ImuResidual::ImuResidual(const Preintegration* preintegration)
    : Factor(15, {kPoseKind, kSpeedBiasKind, kPoseKind, kSpeedBiasKind}),
      preintegration_(preintegration),
      sqrt_information_(preintegration->SqrtInformation()) {}

void ImuResidual::EvaluateAt(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const State i(parameters[0], parameters[1]), j(parameters[2], parameters[3]);
  const double t = preintegration_->duration_s();
  const Preintegration::Motion measured = preintegration_->CorrectedFor(i.bg, i.ba);
  const Matrix3d r_i_t = i.q.conjugate().toRotationMatrix();
  const Vector3d moved = r_i_t * (j.p - i.p - i.v * t - 0.5 * kGravity * t * t);
  const Vector3d gained = r_i_t * (j.v - i.v - kGravity * t);
  const Vector3d turned = LogRotation(measured.rotation.conjugate() * i.q.conjugate() * j.q);

  Eigen::Matrix<double, 15, 1> r;
  r << moved - measured.position_m, turned, gained - measured.velocity_m_s, j.bg - i.bg,
      j.ba - i.ba;
  Map<Eigen::Matrix<double, 15, 1>>{residuals} = sqrt_information_ * r;
  if (!jacobians) return;

  const Matrix3d identity = Matrix3d::Identity();
  const Matrix3d jr_inverse = RightJacobianInverse(turned);
  const Matrix15d& by_bias = preintegration_->jacobian();
  if (jacobians[0]) {
    Jacobian6 d = Jacobian6::Zero();
    d.block<3, 3>(kRowPosition, 0) = -r_i_t;
    d.block<3, 3>(kRowPosition, 3) = Skew(moved);
    d.block<3, 3>(kRowRotation, 3) = -jr_inverse * (j.q.conjugate() * i.q).toRotationMatrix();
    d.block<3, 3>(kRowVelocity, 3) = Skew(gained);
    Map<Jacobian6>{jacobians[0]}.noalias() = sqrt_information_ * d;
  }
  if (jacobians[1]) {
    Jacobian9 d = Jacobian9::Zero();
    d.block<3, 3>(kRowPosition, 0) = -r_i_t * t;
    d.block<3, 3>(kRowVelocity, 0) = -r_i_t;
    d.block<9, 6>(0, 3) = -by_bias.block<9, 6>(0, kRowGyroBias);
    // The bias turns gamma on its right by Exp(J db): carried through the logarithm.
    const Matrix3d by_gyro = by_bias.block<3, 3>(kRowRotation, kRowGyroBias);
    const Vector3d correction = by_gyro * (i.bg - preintegration_->gyro_bias_rad_s());
    d.block<3, 3>(kRowRotation, 3) =
        -jr_inverse * ExpRotation(-turned).toRotationMatrix() * RightJacobian(correction) * by_gyro;
    d.block<3, 3>(kRowGyroBias, 3) = -identity;
    d.block<3, 3>(kRowAccelBias, 6) = -identity;
    Map<Jacobian9>{jacobians[1]}.noalias() = sqrt_information_ * d;
  }
  if (jacobians[2]) {
    Jacobian6 d = Jacobian6::Zero();
    d.block<3, 3>(kRowPosition, 0) = r_i_t;
    d.block<3, 3>(kRowRotation, 3) = jr_inverse;
    Map<Jacobian6>{jacobians[2]}.noalias() = sqrt_information_ * d;
  }
  if (jacobians[3]) {
    Jacobian9 d = Jacobian9::Zero();
    d.block<3, 3>(kRowVelocity, 0) = r_i_t;
    d.block<3, 3>(kRowGyroBias, 3) = identity;
    d.block<3, 3>(kRowAccelBias, 6) = identity;
    Map<Jacobian9>{jacobians[3]}.noalias() = sqrt_information_ * d;
  }
}

}  // namespace slcmap
