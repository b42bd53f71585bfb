#include "odometry/imu/preintegration.h"

#include <Eigen/Cholesky>
#include <utility>

#include "data/rigid_transform.h"

namespace slcmap {
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
      correction_(CorrectionOf(errors)) {
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
  correction_ = CorrectionOf(errors);
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
    by_errors_.col(i) -= (place.is_accel ? force_m_s2 : rate_rad_s)[place.column] *
                         transition.col(bias).head<9>();
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

}  // namespace slcmap
