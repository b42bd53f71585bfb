// Cholesky factorisation of a matrix whose leading blocks hardly know of each other.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace slcmap {

// Turns the lower triangle of a symmetric positive definite matrix into its Cholesky factor L. Of
// the leading blocks, of the sizes given, only those rows are worked on that are not zero: lines
// that meet few poses and no other line cost next to nothing. Zeros may be anywhere; they decide on
// the cost alone. The upper triangle is not looked at. False where the matrix is not positive
// definite.
bool FactorizeBlocks(const std::vector<int>& leading_sizes, Eigen::MatrixXd* matrix);

}  // namespace slcmap
