// IMU preintegration on the manifold (Forster et al., "On-Manifold Preintegration", TRO 2017), and
// the IMU term between two neighbouring states of the window.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "data/core/types.h"
#include "odometry/factors/factor.h"
#include "odometry/geometry/imu.h"

namespace slcmap::inline odometry {

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
// Readings are corrected for the IMU's linear errors first, then for its biases. Between samples
// they are taken as linear in time; the rotation is exact to the fourth order (coning term),
// position and velocity follow by Simpson's rule.
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

  // Integrates other samples instead, about the same biases and errors. What CutRest() has left out
  // stays.
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

// Where one end of an interval's samples was cut: at a stamp on the IMU's clock, and what the
// gyroscope measured there.
struct ImuCut {
  int64_t offset_ns = 0;  // after the stamp that the given time offset has the image at
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();  // with its bias
};

// Blocks: pose i, speed-and-bias i, pose j, speed-and-bias j, IMU calibration (phi, tau,
// delta, e).
// A pose is the body's at the exposure, which was d = delta - offset after the cut. At the cut the
// IMU had, to first order in d, with w = rate - b_g,
//
//   R'_k = R_k Exp(phi) Exp(-w_k d_k)       p'_k = p_k + R_k tau - v_k d_k
//
// and v, the IMU's speed, belongs to the cut. With the preintegrated position alpha, rotation gamma
// and velocity beta over the time T, corrected for e and the biases of i:
//
//   r_p = R'_i^T (p'_j - p'_i - v_i T - g T^2 / 2) - alpha
//   r_R = Log(gamma^T R'_i^T R'_j)
//   r_v = R'_i^T (v_j - v_i - g T) - beta
//   r_b = b_j - b_i                                     (Forster et al., TRO 2017, section VI)
//
// whitened by the preintegration's covariance; g = (0, 0, -9.81).
class ImuResidual final : public Factor {
 public:
  // The preintegration must outlive the residual and not change under it.
  explicit ImuResidual(const Preintegration* preintegration, const ImuCut& from = {},
                       const ImuCut& to = {});

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const Preintegration* preintegration_;
  std::array<ImuCut, 2> cuts_;
  Matrix15d sqrt_information_;
};

// The IMU's pose at the cut, of a body's pose at the exposure; and the other way.
RigidTransform ImuAtCut(const RigidTransform& T_world_body, const double* speed_bias,
                        const double* calibration, const ImuCut& cut);
RigidTransform BodyAtExposure(const RigidTransform& T_world_imu, const double* speed_bias,
                              const double* calibration, const ImuCut& cut);

}  // namespace slcmap::odometry
