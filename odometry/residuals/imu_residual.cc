#include "odometry/residuals/imu_residual.h"

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Jacobian6 = Eigen::Matrix<double, 15, 6, Eigen::RowMajor>;
using JacobianCalibration = Eigen::Matrix<double, 15, kImuCalibrationSize, Eigen::RowMajor>;
using Jacobian9 = Eigen::Matrix<double, 15, 9, Eigen::RowMajor>;
using Matrix153d = Eigen::Matrix<double, 15, 3>;

const Vector3d kGravity(0, 0, -kGravity_m_s2);

// How long after the cut the exposure was.
double ExposureAfter_s(const double* calibration, const ImuCut& cut) {
  return calibration[kRowTimeOffset] - 1e-9 * static_cast<double>(cut.offset_ns);
}

// One end: the IMU's state at the cut, and what its derivatives need.
struct End {
  End(const double* pose, const double* speed_bias, const double* calibration, const ImuCut& cut)
      : R_body(Map<const Quaterniond>(pose + 3).toRotationMatrix()),
        v(speed_bias),
        bg(speed_bias + 3),
        ba(speed_bias + 6),
        tau(calibration + kRowLever),
        phi(calibration + kRowImuRotation),
        rate(cut.rate_rad_s - bg),
        after_s(ExposureAfter_s(calibration, cut)),
        turned_since(-after_s * rate),
        q(Map<const Quaterniond>(pose + 3) * ExpRotation(phi) * ExpRotation(turned_since)),
        p(Map<const Vector3d>(pose) + R_body * tau - after_s * v) {}

  // By the body's turn, of the IMU's turn: dtheta' = R_imu_body dtheta.
  Matrix3d TurnByBody() const { return q.conjugate().toRotationMatrix() * R_body; }
  // By phi.
  Matrix3d TurnByCalibration() const {
    return ExpRotation(-turned_since).toRotationMatrix() * RightJacobian(phi);
  }

  Matrix3d R_body;
  Map<const Vector3d> v, bg, ba, tau;
  Vector3d phi, rate;
  double after_s;
  Vector3d turned_since;  // from the exposure to the cut
  Quaterniond q;          // of the IMU at the cut
  Vector3d p;
};

// The residual (not whitened) by the IMU's position, turn and speed at one cut, and by the biases
// of the state there.
struct ByEnd {
  Matrix153d by_position = Matrix153d::Zero(), by_turn = Matrix153d::Zero(),
             by_speed = Matrix153d::Zero(), by_gyro = Matrix153d::Zero(),
             by_accel = Matrix153d::Zero();

  Jacobian6 ByPose(const End& end) const {
    Jacobian6 d;
    d.leftCols<3>() = by_position;
    d.rightCols<3>() = by_turn * end.TurnByBody() - by_position * end.R_body * Skew(end.tau);
    return d;
  }
  Jacobian9 BySpeedBias(const End& end) const {
    Jacobian9 d;
    d.leftCols<3>() = by_speed - end.after_s * by_position;
    d.middleCols<3>(3) = by_gyro + end.after_s * by_turn * RightJacobian(end.turned_since);
    d.rightCols<3>() = by_accel;
    return d;
  }
  JacobianCalibration ByCalibration(const End& end) const {
    JacobianCalibration d = JacobianCalibration::Zero();
    d.middleCols<3>(kRowImuRotation) = by_turn * end.TurnByCalibration();
    d.middleCols<3>(kRowLever) = by_position * end.R_body;
    d.col(kRowTimeOffset) = -by_turn * end.rate - by_position * end.v;
    return d;
  }
};

}  // namespace

RigidTransform ImuAtCut(const RigidTransform& T_world_body, const double* speed_bias,
                        const double* calibration, const ImuCut& cut) {
  std::array<double, kPoseSize> pose;
  PoseToBlock(T_world_body, pose.data());
  const End end(pose.data(), speed_bias, calibration, cut);
  return {end.q.normalized(), end.p};
}

RigidTransform BodyAtExposure(const RigidTransform& T_world_imu, const double* speed_bias,
                              const double* calibration, const ImuCut& cut) {
  const double after_s = ExposureAfter_s(calibration, cut);
  const Vector3d rate = cut.rate_rad_s - Map<const Vector3d>(speed_bias + 3);
  const RigidTransform at_exposure(
      T_world_imu.rotation * ExpRotation(after_s * rate),
      T_world_imu.translation + after_s * Map<const Vector3d>(speed_bias));
  const RigidTransform T_world_body = at_exposure * BodyFromImu(calibration).Inverse();
  return {T_world_body.rotation.normalized(), T_world_body.translation};
}

ImuResidual::ImuResidual(const Preintegration* preintegration, const ImuCut& from, const ImuCut& to)
    : Factor(15, {kPoseKind, kSpeedBiasKind, kPoseKind, kSpeedBiasKind, kImuCalibrationKind}),
      preintegration_(preintegration),
      cuts_{from, to},
      sqrt_information_(preintegration->SqrtInformation()) {}

void ImuResidual::EvaluateAt(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const End i(parameters[0], parameters[1], parameters[4], cuts_[0]);
  const End j(parameters[2], parameters[3], parameters[4], cuts_[1]);
  const double t = preintegration_->duration_s();
  const Preintegration::Motion measured = preintegration_->CorrectedFor(i.bg, i.ba, ErrorsOf(parameters[4]));
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
  ByEnd by_i, by_j;
  by_i.by_position.middleRows<3>(kRowPosition) = -r_i_t;
  by_i.by_turn.middleRows<3>(kRowPosition) = Skew(moved);
  by_i.by_turn.middleRows<3>(kRowRotation) =
      -jr_inverse * (j.q.conjugate() * i.q).toRotationMatrix();
  by_i.by_turn.middleRows<3>(kRowVelocity) = Skew(gained);
  by_i.by_speed.middleRows<3>(kRowPosition) = -r_i_t * t;
  by_i.by_speed.middleRows<3>(kRowVelocity) = -r_i_t;
  by_i.by_gyro.topRows<9>() = -by_bias.block<9, 3>(0, kRowGyroBias);
  by_i.by_accel.topRows<9>() = -by_bias.block<9, 3>(0, kRowAccelBias);
  // Bias and errors turn gamma on its right by Exp(J db): carried through the logarithm.
  const Matrix3d by_gyro = by_bias.block<3, 3>(kRowRotation, kRowGyroBias);
  const auto by_errors = preintegration_->by_errors();
  const Vector3d correction =
      by_gyro * (i.bg - preintegration_->gyro_bias_rad_s()) +
      by_errors.middleRows<3>(kRowRotation) * (ErrorsOf(parameters[4]) - preintegration_->errors());
  const Matrix3d by_correction =
      -jr_inverse * ExpRotation(-turned).toRotationMatrix() * RightJacobian(correction);
  by_i.by_gyro.middleRows<3>(kRowRotation) = by_correction * by_gyro;
  by_i.by_gyro.middleRows<3>(kRowGyroBias) = -identity;
  by_i.by_accel.middleRows<3>(kRowAccelBias) = -identity;
  by_j.by_position.middleRows<3>(kRowPosition) = r_i_t;
  by_j.by_turn.middleRows<3>(kRowRotation) = jr_inverse;
  by_j.by_speed.middleRows<3>(kRowVelocity) = r_i_t;
  by_j.by_gyro.middleRows<3>(kRowGyroBias) = identity;
  by_j.by_accel.middleRows<3>(kRowAccelBias) = identity;

  const auto whiten = [&](double* out, const auto& d) {
    using Jacobian = std::decay_t<decltype(d)>;
    if (out) Map<Jacobian>{out}.noalias() = sqrt_information_ * d;
  };
  whiten(jacobians[0], by_i.ByPose(i));
  whiten(jacobians[1], by_i.BySpeedBias(i));
  whiten(jacobians[2], by_j.ByPose(j));
  whiten(jacobians[3], by_j.BySpeedBias(j));
  JacobianCalibration by_calibration = by_i.ByCalibration(i) + by_j.ByCalibration(j);
  auto by_e = by_calibration.rightCols<kImuErrorsSize>();
  by_e.topRows<9>() = -by_errors;
  by_e.middleRows<3>(kRowRotation) = by_correction * by_errors.middleRows<3>(kRowRotation);
  whiten(jacobians[4], by_calibration);
}

}  // namespace slcmap
