#include "odometry/window/marginalization.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>

#include "odometry/window/solver.h"

namespace slcmap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// r = A x + B y - c, of any two blocks of three numbers.
class LinearResidual final : public Factor {
 public:
  LinearResidual(const BlockKind& of_x, MatrixXd a, MatrixXd b, VectorXd c)
      : Factor(static_cast<int>(c.size()), {BlockKind{3, 3}, of_x}),
        a_(std::move(a)),
        b_(std::move(b)),
        c_(std::move(c)) {}

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override {
    using Eigen::Vector3d;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
    VectorXd::Map(residuals, rows()) =
        a_ * Vector3d::Map(parameters[1]) + b_ * Vector3d::Map(parameters[0]) - c_;
    if (!jacobians) return;
    if (jacobians[0]) RowMajor::Map(jacobians[0], rows(), 3) = b_;
    if (jacobians[1]) RowMajor::Map(jacobians[1], rows(), 3) = a_;
  }

 private:
  MatrixXd a_, b_;
  VectorXd c_;
};

// Of three columns two that are independent, in units far apart.
MatrixXd DependentColumns(int rows) {
  std::srand(3);
  MatrixXd a = MatrixXd::Random(rows, 3);
  a.col(2) = 1e7 * (a.col(0) - 0.5 * a.col(1));
  a.col(1) *= 1e-6;
  return a;
}

// What is left of y where x is eliminated by any means: |P (B y - c)|^2, P the projection off A.
void ExpectNothingLostOrInvented(const BlockKind& of_x, bool drop) {
  constexpr int kRows = 8;
  std::srand(4);
  const MatrixXd b = MatrixXd::Random(kRows, 3);
  const VectorXd c = VectorXd::Random(kRows);
  for (const MatrixXd& a : {DependentColumns(kRows), MatrixXd(MatrixXd::Zero(kRows, 3)),
                            MatrixXd(MatrixXd::Random(kRows, 3))}) {
    std::array<double, 3> x{}, y{};
    std::vector<Term> terms;
    terms.push_back(
        {std::make_unique<LinearResidual>(of_x, a, b, c), nullptr, {y.data(), x.data()}});
    const Prior prior =
        Marginalize(terms, Prior(), drop ? std::vector<double*>{x.data()} : std::vector<double*>{});
    ASSERT_EQ(prior.blocks, std::vector<double*>{y.data()});

    MatrixXd scaled = a;
    for (int k = 0; k < 3; ++k) scaled.col(k) /= std::max(a.col(k).norm(), 1e-300);
    const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeThinU);
    const Eigen::Index rank = (svd.singularValues().array() > 1e-9).count();
    const MatrixXd u = svd.matrixU().leftCols(rank);
    const MatrixXd off = MatrixXd::Identity(kRows, kRows) - u * u.transpose();
    const MatrixXd information = b.transpose() * off * b;
    EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - information).norm(), 1e-9) << rank;
    EXPECT_LT((prior.jacobian.transpose() * prior.residual + b.transpose() * off * c).norm(), 1e-9)
        << rank;
  }
}

// In two steps, between which the estimate has moved on from where the prior was linearised.
TEST(Marginalize, OfAPriorAndTermsIsTheSchurComplementOfAllThatWasSaid) {
  constexpr int kRows = 8;
  std::srand(6);
  std::array<double, 3> x{}, z{}, y{};
  Prior prior;
  MatrixXd information = MatrixXd::Zero(3, 3);
  VectorXd of_zero = VectorXd::Zero(3);  // the gradient at y = 0
  for (std::array<double, 3>* dropped : {&x, &z}) {
    const MatrixXd a = MatrixXd::Random(kRows, 3), b = MatrixXd::Random(kRows, 3);
    const VectorXd c = VectorXd::Random(kRows);
    const MatrixXd gain = a.colPivHouseholderQr().solve(MatrixXd::Identity(kRows, kRows));
    const MatrixXd off = MatrixXd::Identity(kRows, kRows) - a * gain;
    information += b.transpose() * off * b;
    of_zero -= b.transpose() * off * c;
    std::vector<Term> terms;
    terms.push_back({std::make_unique<LinearResidual>(BlockKind{3, 3}, a, b, c),
                     nullptr,
                     {y.data(), dropped->data()}});
    prior = Marginalize(terms, prior, {dropped->data()});
    y = {0.3, -0.2, 0.1};
  }
  ASSERT_EQ(prior.blocks, std::vector<double*>{y.data()});
  const VectorXd residual = prior.residual + prior.jacobian * prior.Difference(prior.blocks.data());
  const VectorXd gradient = of_zero + information * Eigen::Vector3d::Map(y.data());
  EXPECT_LT((prior.jacobian.transpose() * prior.jacobian - information).norm(), 1e-9);
  EXPECT_LT((prior.jacobian.transpose() * residual - gradient).norm(), 1e-9);
}

TEST(MarginalizeRankDeficient, StatesAndPointsTakeOnlyWhatSpeaksOfThem) {
  ExpectNothingLostOrInvented(BlockKind{3, 3}, true);
  ExpectNothingLostOrInvented(kPointKind, false);
}

// States of as many numbers as a point: only points are eliminated.
TEST(LinearResidual, StatesOfThreeNumbersAreSolvedAsStates) {
  std::srand(5);
  const Eigen::Vector3d true_x(1, 2, 3), true_y(10, 20, 30);
  const MatrixXd a = MatrixXd::Random(8, 3), b = MatrixXd::Random(8, 3);
  std::array<double, 3> x{}, y{};
  std::vector<Term> terms;
  terms.push_back(
      {std::make_unique<LinearResidual>(BlockKind{3, 3}, a, b, VectorXd(a * true_x + b * true_y)),
       nullptr,
       {y.data(), x.data()}});
  const SolverSummary summary = Solve(&terms, Prior(), [](const double*) { return false; },
                                      {.max_iterations = 50, .function_tolerance = 1e-15});
  ASSERT_TRUE(summary.usable);
  EXPECT_LT((Eigen::Vector3d::Map(x.data()) - true_x).norm(), 1e-4);
  EXPECT_LT((Eigen::Vector3d::Map(y.data()) - true_y).norm(), 1e-4);
}

}  // namespace
}  // namespace slcmap
