#include "odometry/factors/imu_factor.h"

#include <Eigen/Cholesky>
#include <utility>

#include "data/core/rigid_transform.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The rotation vector over dt_s of an angular velocity that goes linearly from a to b (Magnus
// expansion to the second term).
Vector3d RotationVector(const Vector3d& a, const Vector3d& b, double dt_s) {
  return 0.5 * dt_s * (a + b) + dt_s * dt_s / 12.0 * a.cross(b);
}

}  // namespace

Preintegration::Preintegration(const ImuNoise& noise, const Vector3d& gyro_bias_rad_s,
                               const Vector3d& accel_bias_m_s2, const ImuErrors& errors)
    : noise_(noise),
      gyro_bias_(gyro_bias_rad_s),
      accel_bias_(accel_bias_m_s2),
      errors_(errors),
      correction_(MakeCorrection(errors)) {
  Reset();
}

void Preintegration::Reset() {
  duration_s_ = 0;
  position_m_.setZero();
  rotation_.setIdentity();
  velocity_m_s_.setZero();
  jacobian_.setIdentity();
  covariance_.setZero();
  by_errors_.setZero();
}

void Preintegration::Append(const ImuSample& sample) {
  if (!samples_.empty()) Step(samples_.back(), sample);
  samples_.push_back(sample);
}

void Preintegration::Repropagate(const Vector3d& gyro_bias_rad_s, const Vector3d& accel_bias_m_s2,
                                 const ImuErrors& errors) {
  gyro_bias_ = gyro_bias_rad_s;
  accel_bias_ = accel_bias_m_s2;
  errors_ = errors;
  correction_ = MakeCorrection(errors);
  Reset();
  AddBiasWalk(cut_s_);
  for (size_t i = 1; i < samples_.size(); ++i) Step(samples_[i - 1], samples_[i]);
}

void Preintegration::Replace(std::vector<ImuSample> samples) {
  samples_ = std::move(samples);
  Repropagate(gyro_bias_, accel_bias_, errors_);
}

void Preintegration::CutRest(int64_t from_ns, int64_t to_ns) {
  std::erase_if(samples_,
                [&](const ImuSample& s) { return s.stamp_ns > from_ns && s.stamp_ns <= to_ns; });
  for (ImuSample& sample : samples_) {
    if (sample.stamp_ns <= from_ns) sample.stamp_ns += to_ns - from_ns;
  }
  cut_s_ += ToSeconds(to_ns - from_ns);
  Repropagate(gyro_bias_, accel_bias_, errors_);
}

void Preintegration::Step(const ImuSample& from, const ImuSample& to) {
  const double dt = ToSeconds(to.stamp_ns - from.stamp_ns);
  const Vector3d w0 = correction_.gyro * from.angular_velocity_rad_s - gyro_bias_;
  const Vector3d w1 = correction_.gyro * to.angular_velocity_rad_s - gyro_bias_;
  const Vector3d a0 = correction_.accel * from.specific_force_m_s2 - accel_bias_;
  const Vector3d a1 = correction_.accel * to.specific_force_m_s2 - accel_bias_;
  const Vector3d am = 0.5 * (a0 + a1);

  const Vector3d phi = RotationVector(w0, w1, dt);
  const Vector3d phi_half = RotationVector(w0, 0.5 * (w0 + w1), 0.5 * dt);
  const Eigen::Quaterniond step = ExpRotation(phi);
  const Matrix3d step_matrix = step.toRotationMatrix();
  const Matrix3d r0 = rotation_.toRotationMatrix();
  const Matrix3d rm = r0 * ExpRotation(phi_half).toRotationMatrix();
  const Matrix3d r1 = r0 * step_matrix;
  const Vector3d mean_for_velocity = (r0 * a0 + 4.0 * rm * am + r1 * a1) / 6.0;
  const Vector3d mean_for_position = (r0 * a0 + 2.0 * rm * am) / 6.0;

  // The transition of the error state; perturbing r0 on the right turns every force of the step.
  Matrix15d f = Matrix15d::Identity();
  f.block<3, 3>(kRowPosition, kRowVelocity) = dt * Matrix3d::Identity();
  f.block<3, 3>(kRowPosition, kRowRotation) = -dt * dt * Skew(mean_for_position) * r0;
  f.block<3, 3>(kRowPosition, kRowGyroBias) = dt * dt * dt / 6.0 * rm * Skew(am);
  f.block<3, 3>(kRowPosition, kRowAccelBias) = -dt * dt / 6.0 * (r0 + 2.0 * rm);
  f.block<3, 3>(kRowRotation, kRowRotation) = step_matrix.transpose();
  f.block<3, 3>(kRowRotation, kRowGyroBias) = -dt * RightJacobian(phi);
  f.block<3, 3>(kRowVelocity, kRowRotation) = -dt * Skew(mean_for_velocity) * r0;
  f.block<3, 3>(kRowVelocity, kRowGyroBias) = dt * dt / 6.0 * (2.0 * rm * Skew(am) + r1 * Skew(a1));
  f.block<3, 3>(kRowVelocity, kRowAccelBias) = -dt / 6.0 * (r0 + 4.0 * rm + r1);
  jacobian_ = f * jacobian_;
  PropagateErrors(f, from, to);
  PropagateCovariance(f, dt);

  position_m_ += velocity_m_s_ * dt + dt * dt * mean_for_position;
  velocity_m_s_ += dt * mean_for_velocity;
  rotation_ = (rotation_ * step).normalized();
  duration_s_ += dt;
}

void Preintegration::PropagateErrors(const Matrix15d& transition, const ImuSample& from,
                                     const ImuSample& to) {
  const Vector3d rate_rad_s = 0.5 * (from.angular_velocity_rad_s + to.angular_velocity_rad_s);
  const Vector3d force_m_s2 = 0.5 * (from.specific_force_m_s2 + to.specific_force_m_s2);
  by_errors_ = (transition.topLeftCorner<9, 9>() * by_errors_).eval();
  for (int i = 0; i < kImuErrorsSize; ++i) {
    const ImuErrorPlace& place = kImuErrorPlaces[i];
    // An error acts as a bias of the other sign and of the size of what is read.
    const int bias = (place.is_accel ? kRowAccelBias : kRowGyroBias) + place.row;
    by_errors_.col(i) -=
        (place.is_accel ? force_m_s2 : rate_rad_s)[place.column] * transition.col(bias).head<9>();
  }
}

void Preintegration::AddBiasWalk(double dt_s) {
  const auto square = [](double x) { return x * x; };
  covariance_.diagonal().segment<3>(kRowGyroBias).array() +=
      square(noise_.gyro_walk_rad_s2_sqrthz) * dt_s;
  covariance_.diagonal().segment<3>(kRowAccelBias).array() +=
      square(noise_.accel_walk_m_s3_sqrthz) * dt_s;
}

// White noise of density d acts over a step like a bias of variance d^2 / dt.
void Preintegration::PropagateCovariance(const Matrix15d& transition, double dt_s) {
  const auto square = [](double x) { return x * x; };
  const double gyro_variance = square(noise_.gyro_noise_rad_s_sqrthz) / dt_s;
  const double accel_variance = square(noise_.accel_noise_m_s2_sqrthz) / dt_s;
  const Eigen::Matrix<double, 9, 3> by_gyro = transition.block<9, 3>(0, kRowGyroBias);
  const Eigen::Matrix<double, 9, 3> by_accel = transition.block<9, 3>(0, kRowAccelBias);
  covariance_ = (transition * covariance_ * transition.transpose()).eval();
  covariance_.topLeftCorner<9, 9>() += gyro_variance * by_gyro * by_gyro.transpose() +
                                       accel_variance * by_accel * by_accel.transpose();
  AddBiasWalk(dt_s);
}

Preintegration::Motion Preintegration::CorrectedFor(const Vector3d& gyro_bias_rad_s,
                                                    const Vector3d& accel_bias_m_s2,
                                                    const ImuErrors& errors) const {
  Eigen::Matrix<double, 6, 1> change;
  change << gyro_bias_rad_s - gyro_bias_, accel_bias_m_s2 - accel_bias_;
  const Eigen::Matrix<double, 9, 1> d =
      jacobian_.block<9, 6>(0, kRowGyroBias) * change + by_errors_ * (errors - errors_);
  return {position_m_ + d.segment<3>(kRowPosition),
          (rotation_ * ExpRotation(d.segment<3>(kRowRotation))).normalized(),
          velocity_m_s_ + d.segment<3>(kRowVelocity)};
}

Matrix15d Preintegration::SqrtInformation() const {
  Matrix15d covariance = covariance_;
  covariance.diagonal().array() += 1e-18;  // keeps a noise of zero invertible
  const Eigen::LLT<Matrix15d> llt(covariance);
  return llt.matrixL().solve(Matrix15d::Identity());
}

namespace {

using Eigen::Map;
using Eigen::Quaterniond;
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
  const Preintegration::Motion measured =
      preintegration_->CorrectedFor(i.bg, i.ba, GetErrors(parameters[4]));
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
  const Vector3d correction = by_gyro * (i.bg - preintegration_->gyro_bias_rad_s()) +
                              by_errors.middleRows<3>(kRowRotation) *
                                  (GetErrors(parameters[4]) - preintegration_->errors());
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

}  // namespace slcmap::odometry
