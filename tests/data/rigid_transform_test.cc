#include "data/core/rigid_transform.h"

#include <gtest/gtest.h>

#include "data/core/error.h"

namespace slcmap {
namespace {

TEST(Rotation, LogInvertsExpFromTinyToPi) {
  for (const double angle_rad : {0.0, 1e-9, 1e-6, 1e-3, 0.5, 3.0, 3.141}) {
    const Eigen::Vector3d omega = angle_rad * Eigen::Vector3d(1, -2, 0.5).normalized();
    EXPECT_LT((LogRotation(ExpRotation(omega)) - omega).norm(), 1e-12) << angle_rad;
  }
}

TEST(Rotation, LogIsTheSameForBothSignsOfTheQuaternion) {
  const Eigen::Vector3d omega(0.3, -0.2, 2.5);
  Eigen::Quaterniond q = ExpRotation(omega);
  q.coeffs() *= -1;
  EXPECT_LT((LogRotation(q) - omega).norm(), 1e-12);
}

TEST(Rotation, RightJacobianMatchesDifferences) {
  for (const double angle_rad : {1e-6, 0.01, 1.0, 2.5}) {
    const Eigen::Vector3d omega = angle_rad * Eigen::Vector3d(0.2, 1, -0.7).normalized();
    const Eigen::Matrix3d jacobian = RightJacobian(omega);
    for (int k = 0; k < 3; ++k) {
      const double step = 1e-6;
      const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d difference =
          LogRotation(ExpRotation(omega).conjugate() * ExpRotation(omega + d)) / step;
      EXPECT_LT((difference - jacobian.col(k)).norm(), 1e-5);
    }
    EXPECT_LT((jacobian * RightJacobianInverse(omega) - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(RigidTransform, ComposesAndInverts) {
  const RigidTransform a(ExpRotation({0.1, 0.2, -0.4}), {1, 2, 3});
  const RigidTransform b(ExpRotation({-1.1, 0.2, 0.4}), {-1, 0.5, 9});
  const Eigen::Vector3d p(0.3, -0.2, 4);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
  EXPECT_LT((a.Inverse() * (a * p) - p).norm(), 1e-12);
}

TEST(RigidTransform, RefusesAMatrixThatIsNoRotation) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m(0, 0) = 1.1;
  EXPECT_THROW(RigidTransformFromMatrix(m, "cam0 T_BS"), DataError);
}

TEST(RigidTransform, AMatrixNeedsItsLastRow) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  EXPECT_NO_THROW(RigidTransformFromMatrix(matrix, "T_BS"));
  matrix(3, 2) = 5;
  EXPECT_THROW(RigidTransformFromMatrix(matrix, "T_BS"), DataError);
}

}  // namespace
}  // namespace slcmap
