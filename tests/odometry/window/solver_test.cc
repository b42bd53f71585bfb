#include "odometry/window/solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

namespace slcmap {
namespace {

using Eigen::MatrixXd;

bool NoneConstant(const double*) { return false; }

// What a speed and bias block is drawn to, with rows so nearly dependent and so large that the
// Hessian is singular by rounding, and the least damping is lost in it too.
class SingularSystem : public ::testing::Test {
 protected:
  SingularSystem() {
    prior_.blocks = {block_.data()};
    prior_.kinds = {kSpeedBiasKind};
    prior_.x_lin = {std::vector<double>(block_.begin(), block_.end())};
    prior_.jacobian.resize(1, kSpeedBiasSize);
    for (int i = 0; i < kSpeedBiasSize; ++i) prior_.jacobian(0, i) = kScale / (3 + 2 * i);
    prior_.residual = Eigen::VectorXd::Ones(1);
  }

  static constexpr double kScale = 1e23;
  SpeedBiasBlock block_{};
  Prior prior_;
  std::vector<Term> terms_;
};

TEST_F(SingularSystem, CannotBeSolvedWithLittleDampingButWithMore) {
  NormalEquations equations(terms_, prior_, NoneConstant);
  equations.Linearize();
  EXPECT_FALSE(equations.SolveDamped(1e4).has_value());
  ASSERT_TRUE(equations.SolveDamped(1).has_value());
  EXPECT_GT(*equations.SolveDamped(1), 0);
}

TEST_F(SingularSystem, IsRetriedWithMoreDamping) {
  const SolverSummary summary = Solve(&terms_, prior_, NoneConstant, {});
  EXPECT_TRUE(summary.usable);
  EXPECT_DOUBLE_EQ(summary.initial_cost, 0.5);
  EXPECT_LT(summary.final_cost, 1e-3);
}

// Its residual is finite where its Jacobian is not.
class WithoutJacobian final : public Factor {
 public:
  WithoutJacobian() : Factor(1, {kSpeedBiasKind}) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    residuals[0] = 1 + parameters[0][0];
    if (!jacobians || !jacobians[0]) return;
    std::fill_n(jacobians[0], kSpeedBiasSize, std::numeric_limits<double>::quiet_NaN());
  }
};

TEST(Solve, IsNotUsableWhereNoDampingHelpsAndLeavesTheBlocksAsTheyWere) {
  SpeedBiasBlock block{1, 2, 3};
  std::vector<Term> terms(1);
  terms[0].factor = std::make_unique<WithoutJacobian>();
  terms[0].blocks[0] = block.data();
  const SolverSummary summary = Solve(&terms, Prior(), NoneConstant, {});
  EXPECT_FALSE(summary.usable);
  EXPECT_EQ(block, (SpeedBiasBlock{1, 2, 3}));
  EXPECT_DOUBLE_EQ(summary.final_cost, summary.initial_cost);
}

// A minimum is found at once, and is one.
TEST(Solve, IsUsableAtAMinimum) {
  SpeedBiasBlock block{};
  Prior prior;
  prior.blocks = {block.data()};
  prior.kinds = {kSpeedBiasKind};
  prior.x_lin = {std::vector<double>(block.begin(), block.end())};
  prior.jacobian = Eigen::MatrixXd::Identity(kSpeedBiasSize, kSpeedBiasSize);
  prior.residual = Eigen::VectorXd::Zero(kSpeedBiasSize);
  std::vector<Term> terms;
  const SolverSummary summary = Solve(&terms, prior, NoneConstant, {});
  EXPECT_TRUE(summary.usable);
  EXPECT_EQ(summary.iterations, 1);
}

// Positive definite; the first `leading` pairs of columns know of the last six alone.
MatrixXd Arrow(int leading, int rest) {
  const int size = 2 * leading + rest;
  MatrixXd rows = MatrixXd::Zero(3 * size, size);
  rows.rightCols(rest).setRandom();
  for (int k = 0; k < leading; ++k) rows.block(6 * k, 2 * k, 6, 2).setRandom();
  return MatrixXd(rows.transpose() * rows) + MatrixXd::Identity(size, size);
}

MatrixXd Lower(const MatrixXd& matrix) { return matrix.triangularView<Eigen::Lower>(); }

TEST(FactorizeBlocks, IsTheCholeskyFactor) {
  const MatrixXd random = MatrixXd::Random(20, 9);
  const std::pair<std::vector<int>, MatrixXd> systems[] = {
      {{2, 2, 2, 2, 2}, Arrow(5, 0)},
      {{2, 2, 2, 2, 2}, Arrow(5, 7)},
      {{4, 2}, random.transpose() * random}};  // whose leading blocks know of each other
  for (const auto& [blocks, matrix] : systems) {
    MatrixXd factor = matrix;
    ASSERT_TRUE(FactorizeBlocks(blocks, &factor));
    EXPECT_LT((Lower(factor) - MatrixXd(matrix.llt().matrixL())).norm(), 1e-12 * matrix.norm());
  }
}

TEST(FactorizeBlocks, RefusesWhatIsNotPositiveDefinite) {
  MatrixXd in_block = Arrow(3, 4), in_rest = in_block;
  in_block(3, 3) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_block));
  in_rest(8, 8) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_rest));
}

}  // namespace
}  // namespace slcmap
