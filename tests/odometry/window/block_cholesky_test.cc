#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "odometry/window/solver.h"

namespace slcmap {
namespace {

using Eigen::MatrixXd;

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
  for (const int rest : {0, 1, 7}) {
    const MatrixXd matrix = Arrow(5, rest);
    MatrixXd factor = matrix;
    ASSERT_TRUE(FactorizeBlocks({2, 2, 2, 2, 2}, &factor));
    EXPECT_LT((Lower(factor) - MatrixXd(matrix.llt().matrixL())).norm(), 1e-12 * matrix.norm());
  }
}

TEST(FactorizeBlocks, LeadingBlocksMayKnowOfEachOther) {
  const MatrixXd random = MatrixXd::Random(20, 9);
  const MatrixXd matrix = random.transpose() * random;
  MatrixXd factor = matrix;
  ASSERT_TRUE(FactorizeBlocks({4, 2}, &factor));
  EXPECT_LT((Lower(factor) - MatrixXd(matrix.llt().matrixL())).norm(), 1e-12 * matrix.norm());
}

TEST(FactorizeBlocks, RefusesWhatIsNotPositiveDefinite) {
  MatrixXd in_block = Arrow(3, 4), in_rest = in_block;
  in_block(3, 3) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_block));
  in_rest(8, 8) = -1;
  EXPECT_FALSE(FactorizeBlocks({2, 2, 2}, &in_rest));
}

TEST(FactorizeBlocks, AnEmptyMatrixHasAFactor) {
  MatrixXd none(0, 0);
  EXPECT_TRUE(FactorizeBlocks({}, &none));
}

}  // namespace
}  // namespace slcmap
