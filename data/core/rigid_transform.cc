#include "data/core/rigid_transform.h"

#include <cmath>
#include <sstream>

#include "data/core/error.h"

namespace slcmap::inline data {

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Quaterniond ExpRotation(const Eigen::Vector3d& omega_rad) {
  const double angle = omega_rad.norm();
  // sin(angle / 2) / angle by its series near zero.
  const double s = angle < 1e-5 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = s * omega_rad;
  return q.normalized();
}

Eigen::Vector3d LogRotation(const Eigen::Quaterniond& q) {
  const double n = q.vec().norm();
  if (n < 1e-10) return 2.0 * (q.w() < 0 ? -1.0 : 1.0) * q.vec();
  const double angle = 2.0 * (q.w() < 0 ? std::atan2(-n, -q.w()) : std::atan2(n, q.w()));
  return q.vec() * (angle / n);
}

Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& omega_rad) {
  const double angle = omega_rad.norm();
  const Eigen::Matrix3d s = Skew(omega_rad);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - 0.5 * s + s * s / 6.0;
  const double angle2 = angle * angle;
  return Eigen::Matrix3d::Identity() - (1.0 - std::cos(angle)) / angle2 * s +
         (angle - std::sin(angle)) / (angle2 * angle) * s * s;
}

Eigen::Matrix3d RightJacobianInverse(const Eigen::Vector3d& omega_rad) {
  const double angle = omega_rad.norm();
  const Eigen::Matrix3d s = Skew(omega_rad);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() + 0.5 * s + s * s / 12.0;
  const double half = 0.5 * angle;
  const double c = (1.0 - half * std::cos(half) / std::sin(half)) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * s + c * s * s;
}

Eigen::Matrix4d RigidTransform::Matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

RigidTransform RigidTransformFromMatrix(const Eigen::Matrix4d& matrix, const std::string& name) {
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (matrix.allFinite() && error <= 1e-3 && r.determinant() < 0) {
    throw DataError(name +
                    ": found a mirrored rotation (determinant -1), expected a rotation: an axis is "
                    "negated, or two are swapped");
  }
  if (!matrix.allFinite() || error > 1e-3) {
    throw DataError(name + ": found a matrix whose rotation part is not a rotation, expected one");
  }
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6) {
    std::ostringstream row;
    row << matrix.row(3);
    throw DataError(name + ": found the last row '" + row.str() + "', expected 0 0 0 1");
  }
  return {Eigen::Quaterniond(r).normalized(), matrix.topRightCorner<3, 1>()};
}

RigidTransform Interpolate(const RigidTransform& a, const RigidTransform& b, double u) {
  return {a.rotation.slerp(u, b.rotation), (1.0 - u) * a.translation + u * b.translation};
}

}  // namespace slcmap::data
