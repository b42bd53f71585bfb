#include "odometry/window/solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slcmap {
namespace {

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

}  // namespace
}  // namespace slcmap
