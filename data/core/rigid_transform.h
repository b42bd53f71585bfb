// Rotations and rigid transforms.
//
// T_a_b maps a point given in frame b to frame a: p_a = T_a_b * p_b, and T_a_c = T_a_b * T_b_c.
// Rotations are perturbed on the right: R <- R Exp(delta), delta in radians in the right-hand
// frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

namespace slcmap::inline data {

// The skew-symmetric matrix of v: Skew(v) * w = v x w.
Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

// The rotation by the angle |omega_rad| about the direction of omega_rad.
Eigen::Quaterniond ExpRotation(const Eigen::Vector3d& omega_rad);

// The rotation vector of q, of length at most pi; the inverse of ExpRotation.
Eigen::Vector3d LogRotation(const Eigen::Quaterniond& q);

// The right Jacobian of SO(3): Exp(omega + d) ~ Exp(omega) Exp(Jr(omega) d), and its inverse.
Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& omega_rad);
Eigen::Matrix3d RightJacobianInverse(const Eigen::Vector3d& omega_rad);

struct RigidTransform {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // metres

  RigidTransform() = default;
  RigidTransform(const Eigen::Quaterniond& q, const Eigen::Vector3d& t)
      : rotation(q), translation(t) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
  RigidTransform operator*(const RigidTransform& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  RigidTransform Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, -(inverse * translation)};
  }
  Eigen::Matrix4d Matrix() const;
};

// The transform of a 4x4 matrix with last row 0 0 0 1 and a rotation part that is orthonormal to
// within 1e-3 and made exactly so. Throws DataError otherwise; `name` stands in the message.
RigidTransform RigidTransformFromMatrix(const Eigen::Matrix4d& matrix, const std::string& name);

// The transform between two at the fraction u in [0, 1]: slerp for the rotation, linear for the
// rest.
RigidTransform Interpolate(const RigidTransform& a, const RigidTransform& b, double u);

}  // namespace slcmap::data
