// States of any size among the kinds of blocks: only points are eliminated.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "odometry/factors/blocks.h"
#include "odometry/window/marginalization.h"
#include "odometry/window/solver.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Of as many numbers as a point.
constexpr BlockKind kOffsetKind{3, 3};

// r = (b - a - measured) / sigma; without a, r = (b - measured) / sigma.
class OffsetResidual final : public Factor {
 public:
  OffsetResidual(const Vector3d& measured, double sigma, bool between)
      : Factor(3, between ? std::initializer_list<BlockKind>{kOffsetKind, kOffsetKind}
                          : std::initializer_list<BlockKind>{kOffsetKind}),
        measured_(measured),
        weight_(1 / sigma) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    Vector3d off = Vector3d::Map(parameters[blocks() - 1]) - measured_;
    if (blocks() == 2) off -= Vector3d::Map(parameters[0]);
    Vector3d::Map(residuals) = weight_ * off;
    for (int k = 0; jacobians && k < blocks(); ++k) {
      const double sign = k == blocks() - 1 ? 1 : -1;
      if (jacobians[k]) Eigen::Matrix3d::Map(jacobians[k]) = sign * weight_ * I();
    }
  }

 private:
  static Eigen::Matrix3d I() { return Eigen::Matrix3d::Identity(); }
  Vector3d measured_;
  double weight_;
};

class OffsetsTest : public ::testing::Test {
 protected:
  OffsetsTest() {
    terms_.push_back(
        {std::make_unique<OffsetResidual>(Vector3d(1, 2, 3), 3, false), nullptr, {first_.data()}});
    terms_.push_back({std::make_unique<OffsetResidual>(Vector3d(10, 20, 30), 4, true),
                      nullptr,
                      {first_.data(), second_.data()}});
  }
  std::array<double, 3> first_{}, second_{};
  std::vector<Term> terms_;
};

TEST_F(OffsetsTest, AreSolvedAsStates) {
  const SolverSummary summary = Solve(&terms_, Prior(), [](const double*) { return false; },
                                      {.max_iterations = 20, .function_tolerance = 1e-15});
  ASSERT_TRUE(summary.usable);
  EXPECT_LT((Vector3d::Map(first_.data()) - Vector3d(1, 2, 3)).norm(), 1e-6);
  EXPECT_LT((Vector3d::Map(second_.data()) - Vector3d(11, 22, 33)).norm(), 1e-6);
}

TEST_F(OffsetsTest, StayInThePriorUnlessTheyAreDropped) {
  const Prior prior = Marginalize(terms_, Prior(), {first_.data()});
  ASSERT_EQ(prior.blocks, std::vector<double*>{second_.data()});
  ASSERT_EQ(prior.kinds[0].tangent_size, 3);
  // Variances add: 3^2 + 4^2 = 5^2.
  const Eigen::Matrix3d information = prior.jacobian.transpose() * prior.jacobian;
  EXPECT_LT((information - Eigen::Matrix3d::Identity() / 25).norm(), 1e-12);
  const Vector3d mean = -information.inverse() * (prior.jacobian.transpose() * prior.residual);
  EXPECT_LT((mean - Vector3d(11, 22, 33)).norm(), 1e-9);
}

}  // namespace
}  // namespace slcmap
