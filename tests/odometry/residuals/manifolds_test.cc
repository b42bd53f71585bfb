#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "odometry/factors/factor.h"

// The header of Ceres speaks of its own names without their namespace.
using namespace ceres;  // NOLINT
#include <ceres/manifold_test_utils.h>

namespace slcmap {
namespace {

TEST(PoseManifold, KeepsTheAxiomsOfAManifold) {
  const PoseManifold manifold;
  for (int i = 0; i < 50; ++i) {
    Eigen::VectorXd x = Eigen::VectorXd::Random(kPoseSize), y = Eigen::VectorXd::Random(kPoseSize);
    x.tail<4>().normalize();
    y.tail<4>().normalize();
    if (x.tail<4>().dot(y.tail<4>()) < 0) y.tail<4>() *= -1;  // the same rotation, the nearer sign
    const Eigen::VectorXd delta = Eigen::VectorXd::Random(kPoseTangentSize);
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
  }
}

TEST(OrthonormalLineManifold, KeepsTheAxiomsOfAManifold) {
  const OrthonormalLineManifold manifold;
  for (int i = 0; i < 50; ++i) {
    Eigen::VectorXd x = Eigen::VectorXd::Random(kGeneralLineSize);
    Eigen::VectorXd y = Eigen::VectorXd::Random(kGeneralLineSize);
    x.head<4>().normalize();
    y.head<4>().normalize();
    if (x.head<4>().dot(y.head<4>()) < 0) y.head<4>() *= -1;  // the same rotation, the nearer sign
    const Eigen::VectorXd delta = Eigen::VectorXd::Random(kGeneralLineTangentSize);
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-8);
  }
}

TEST(PoseManifold, TurnsOnTheRight) {
  const RigidTransform pose(ExpRotation({0.3, -1.2, 0.5}), {1, 2, 3});
  double block[kPoseSize], moved[kPoseSize];
  PoseToBlock(pose, block);
  const double delta[] = {0.1, 0.2, 0.3, 0.01, -0.02, 0.03};
  PoseManifold().Plus(block, delta, moved);
  const Eigen::Quaterniond expected = pose.rotation * ExpRotation({0.01, -0.02, 0.03});
  EXPECT_LT(PoseFromBlock(moved).rotation.angularDistance(expected), 1e-12);
  EXPECT_LT((PoseFromBlock(moved).translation - Eigen::Vector3d(1.1, 2.2, 3.3)).norm(), 1e-12);
}

}  // namespace
}  // namespace slcmap
