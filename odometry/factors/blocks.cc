#include "odometry/factors/blocks.h"

#include <Eigen/Core>
#include <algorithm>
#include <functional>

namespace slcmap::inline odometry {

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

ceres::Manifold* SharedPoseManifold() {
  static PoseManifold manifold;
  return &manifold;
}

ceres::Manifold* SharedLineManifold() {
  static OrthonormalLineManifold manifold;
  return &manifold;
}

void BlockPlus(const BlockKind& kind, const double* x, const double* delta, double* x_plus_delta) {
  if (kind.manifold) {
    kind.manifold()->Plus(x, delta, x_plus_delta);
  } else {
    std::transform(x, x + kind.size, delta, x_plus_delta, std::plus<>());
  }
}

void BlockMinus(const BlockKind& kind, const double* y, const double* x, double* y_minus_x) {
  if (kind.manifold) {
    kind.manifold()->Minus(y, x, y_minus_x);
  } else {
    std::transform(y, y + kind.size, x, y_minus_x, std::minus<>());
  }
}

void JacobianByBlock(const BlockKind& kind, const double* x, int rows, const double* by_tangent,
                     double* by_block) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (!kind.manifold) {
    std::copy_n(by_tangent, rows * kind.size, by_block);
    return;
  }
  RowMajor minus(kind.tangent_size, kind.size);
  kind.manifold()->MinusJacobian(x, minus.data());
  Eigen::Map<RowMajor>(by_block, rows, kind.size).noalias() =
      Eigen::Map<const RowMajor>(by_tangent, rows, kind.tangent_size).lazyProduct(minus);
}

}  // namespace slcmap::odometry
