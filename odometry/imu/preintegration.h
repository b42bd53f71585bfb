// IMU preintegration on the manifold (Forster et al., "On-Manifold Preintegration", TRO 2017).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "data/types.h"
#include "odometry/imu/imu_errors.h"

namespace slcmap {

using Matrix15d = Eigen::Matrix<double, 15, 15>;

// Offsets into the 15 rows of a preintegrated measurement and of the IMU residual.
enum PreintegrationRow {
  kRowPosition = 0,
  kRowRotation = 3,
  kRowVelocity = 6,
  kRowGyroBias = 9,
  kRowAccelBias = 12
};

// The motion between two stamps, in the frame of the first, as far as the IMU alone tells it:
// position and velocity without gravity and without the starting velocity, and the rotation.
//
// Readings are corrected for the IMU's linear errors first, then for its biases. Between samples they
// are taken as linear in time; the rotation is exact to the fourth order (coning term), position and
// velocity follow by Simpson's rule.
class Preintegration {
 public:
  Preintegration(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias_rad_s,
                 const Eigen::Vector3d& accel_bias_m_s2,
                 const ImuErrors& errors = ImuErrors::Zero());

  // Appends a sample; the first one only starts the interval. Stamps must rise.
  void Append(const ImuSample& sample);

  // Integrates all samples again about new biases and linear errors.
  void Repropagate(const Eigen::Vector3d& gyro_bias_rad_s, const Eigen::Vector3d& accel_bias_m_s2,
                   const ImuErrors& errors);

  // Integrates other samples instead, about the same biases and errors. What CutRest() has left out stays.
  void Replace(std::vector<ImuSample> samples);

  // Leaves out what lies between two stamps, when the rig is known to have been at rest: the
  // samples before move up to those after. Only the biases walk on meanwhile.
  void CutRest(int64_t from_ns, int64_t to_ns);

  // The measurement, corrected to first order for other biases and errors than those it was
  // integrated with; without errors, for those it was integrated with.
  struct Motion {
    Eigen::Vector3d position_m;
    Eigen::Quaterniond rotation;
    Eigen::Vector3d velocity_m_s;
  };
  Motion CorrectedFor(const Eigen::Vector3d& gyro_bias_rad_s,
                      const Eigen::Vector3d& accel_bias_m_s2, const ImuErrors& errors) const;
  Motion CorrectedFor(const Eigen::Vector3d& gyro_bias_rad_s,
                      const Eigen::Vector3d& accel_bias_m_s2) const {
    return CorrectedFor(gyro_bias_rad_s, accel_bias_m_s2, errors_);
  }

  // W with W^T W = covariance^-1, rows in the order of PreintegrationRow.
  Matrix15d SqrtInformation() const;

  double duration_s() const { return duration_s_; }  // without what was cut
  const std::vector<ImuSample>& samples() const { return samples_; }
  const Eigen::Vector3d& gyro_bias_rad_s() const { return gyro_bias_; }
  const Eigen::Vector3d& accel_bias_m_s2() const { return accel_bias_; }
  const ImuErrors& errors() const { return errors_; }
  const Matrix15d& covariance() const { return covariance_; }
  // d (position, rotation, velocity, biases) / d (the same at the start): its bias columns correct.
  const Matrix15d& jacobian() const { return jacobian_; }
  // d (position, rotation, velocity) / d errors.
  using ByErrors = Eigen::Matrix<double, 9, kImuErrorsSize>;
  const ByErrors& by_errors() const { return by_errors_; }

 private:
  void Reset();
  void AddBiasWalk(double dt_s);
  void Step(const ImuSample& from, const ImuSample& to);
  void PropagateErrors(const Matrix15d& transition, const ImuSample& from, const ImuSample& to);
  void PropagateCovariance(const Matrix15d& transition, double dt_s);

  ImuNoise noise_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
  ImuErrors errors_;
  ImuCorrection correction_;  // of the errors
  std::vector<ImuSample> samples_;
  double duration_s_ = 0, cut_s_ = 0;
  Eigen::Vector3d position_m_;
  Eigen::Quaterniond rotation_;
  Eigen::Vector3d velocity_m_s_;
  Matrix15d jacobian_;
  Matrix15d covariance_;
  ByErrors by_errors_;
};

}  // namespace slcmap
