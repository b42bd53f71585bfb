#include "odometry/residuals/zero_velocity_residual.h"

namespace slcmap {

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

}  // namespace slcmap
