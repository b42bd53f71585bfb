#include "odometry/residuals/line_manifold.h"

#include "odometry/residuals/pose_manifold.h"

namespace slcmap {

using Eigen::Map;
using Eigen::Quaterniond;
using Eigen::Vector3d;

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

}  // namespace slcmap
