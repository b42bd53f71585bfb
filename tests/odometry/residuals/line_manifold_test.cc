#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "odometry/factors/blocks.h"

// The header of Ceres speaks of its own names without their namespace.
using namespace ceres;  // NOLINT
#include <ceres/manifold_test_utils.h>

namespace slcmap {
namespace {

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

}  // namespace
}  // namespace slcmap
