// The IMU term between two neighbouring states of the window.
#pragma once

#include "odometry/imu/preintegration.h"
#include "odometry/residuals/calibration.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

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

}  // namespace slcmap
