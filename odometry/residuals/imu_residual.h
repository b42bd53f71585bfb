// The IMU term between two neighbouring states of the window.
#pragma once

#include "odometry/imu/preintegration.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// Blocks: pose i, speed-and-bias i, pose j, speed-and-bias j. With the preintegrated position
// alpha, rotation gamma and velocity beta over the time T, corrected for the biases of i:
//
//   r_p = R_i^T (p_j - p_i - v_i T - g T^2 / 2) - alpha
//   r_R = Log(gamma^T R_i^T R_j)
//   r_v = R_i^T (v_j - v_i - g T) - beta
//   r_b = b_j - b_i                                     (Forster et al., TRO 2017, section VI)
//
// whitened by the preintegration's covariance; g = (0, 0, -9.81).
class ImuResidual final : public Factor {
 public:
  // The preintegration must outlive the residual and not change under it.
  explicit ImuResidual(const Preintegration* preintegration);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const Preintegration* preintegration_;
  Matrix15d sqrt_information_;
};

}  // namespace slcmap
