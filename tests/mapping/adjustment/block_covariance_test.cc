#include <ceres/autodiff_cost_function.h>
#include <gtest/gtest.h>

#include <array>

#include "mapping/adjustment/closure_terms.h"

namespace slcmap {
namespace {

struct Known {
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    residual[0] = x[0] / 2.0;
    return true;
  }
};

// All that is said of a block of two: as of the distance of a line that one image shows.
struct OneOfTwo {
  template <typename T>
  bool operator()(const T* x, const T* line, T* residual) const {
    residual[0] = x[0] + line[0] + 2.0 * line[1];
    return true;
  }
};

TEST(BlockCovariance, IsKnownBesideBlocksThatAreNot) {
  double x = 0.1;
  std::array<double, 2> line{0.3, -0.2};
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Known, 1, 1>(new Known), nullptr, &x);
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<OneOfTwo, 1, 1, 2>(new OneOfTwo),
                           nullptr, &x, line.data());
  const Eigen::MatrixXd of_x = BlockCovariance(&problem, {&x});
  ASSERT_EQ(of_x.size(), 1);
  EXPECT_NEAR(of_x(0, 0), 4, 1e-6);
  EXPECT_EQ(BlockCovariance(&problem, {line.data()}).size(), 0);
}

}  // namespace
}  // namespace slcmap
