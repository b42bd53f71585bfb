// The parameter blocks of the estimator and how they are perturbed.
#pragma once

#include <ceres/manifold.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "data/rigid_transform.h"

namespace slcmap {

// A pose block is (p_world_imu, q_world_imu as x y z w). Its tangent is (dp, dtheta):
// p <- p + dp in world axes, R <- R Exp(dtheta) in body axes.
inline constexpr int kPoseSize = 7;
inline constexpr int kPoseTangentSize = 6;

// A speed-and-bias block is (v_world, gyroscope bias, accelerometer bias), perturbed by addition.
inline constexpr int kSpeedBiasSize = 9;

using Matrix34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return kPoseTangentSize; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// d Log(x^-1 y) / d y at y = x for rotations stored as x y z w.
Matrix34d RotationMinusJacobian(const double* quaternion);

RigidTransform PoseFromBlock(const double* pose);
void PoseToBlock(const RigidTransform& pose, double* block);

}  // namespace slcmap
