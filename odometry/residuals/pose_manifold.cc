#include "odometry/residuals/pose_manifold.h"

namespace slcmap {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Map<Vector3d>{x_plus_delta} = Map<const Vector3d>(x) + Map<const Vector3d>(delta);
  Map<Quaterniond>{x_plus_delta + 3} =
      (Map<const Quaterniond>(x + 3) * ExpRotation(Map<const Vector3d>(delta + 3))).normalized();
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  // q (delta / 2, 1) to first order; its transpose is a quarter of the Jacobian of Minus.
  Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<3, 3>().setIdentity();
  j.bottomRightCorner<4, 3>() = 0.25 * RotationMinusJacobian(x + 3).transpose();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Map<Vector3d>{y_minus_x} = Map<const Vector3d>(y) - Map<const Vector3d>(x);
  Map<Vector3d>{y_minus_x + 3} =
      LogRotation(Map<const Quaterniond>(x + 3).conjugate() * Map<const Quaterniond>(y + 3));
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topLeftCorner<3, 3>().setIdentity();
  j.bottomRightCorner<3, 4>() = RotationMinusJacobian(x + 3);
  return true;
}

Matrix34d RotationMinusJacobian(const double* quaternion) {
  const Map<const Quaterniond> q(quaternion);
  Matrix34d j;
  j.leftCols<3>() = 2.0 * (q.w() * Matrix3d::Identity() - Skew(q.vec()));
  j.rightCols<1>() = -2.0 * q.vec();
  return j;
}

RigidTransform PoseFromBlock(const double* pose) {
  return {Quaterniond(Map<const Quaterniond>(pose + 3)), Map<const Vector3d>(pose)};
}

void PoseToBlock(const RigidTransform& pose, double* block) {
  Map<Vector3d>{block} = pose.translation;
  Map<Quaterniond>{block + 3} = pose.rotation;
}

}  // namespace slcmap
