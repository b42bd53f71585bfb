#include "odometry/window/block_cholesky.h"

#include <Eigen/Cholesky>

namespace slcmap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Rows below a block that are not zero in its columns.
std::vector<Index> RowsBelow(const MatrixXd& matrix, Index offset, Index size) {
  std::vector<Index> rows;
  for (Index row = offset + size; row < matrix.rows(); ++row) {
    if ((matrix.row(row).segment(offset, size).array() != 0).any()) rows.push_back(row);
  }
  return rows;
}

bool EliminateBlock(Index offset, Index size, MatrixXd* matrix) {
  const Eigen::LLT<MatrixXd> own(matrix->block(offset, offset, size, size));
  if (own.info() != Eigen::Success) return false;
  matrix->block(offset, offset, size, size).triangularView<Eigen::Lower>() = own.matrixL();
  const std::vector<Index> rows = RowsBelow(*matrix, offset, size);
  const auto count = static_cast<Index>(rows.size());
  MatrixXd below(size, count);
  for (Index i = 0; i < count; ++i) {
    below.col(i) = matrix->row(rows[i]).segment(offset, size).transpose();
  }
  own.matrixL().solveInPlace(below);
  const MatrixXd product = below.transpose() * below;
  for (Index j = 0; j < count; ++j) {
    matrix->row(rows[j]).segment(offset, size) = below.col(j).transpose();
    for (Index i = j; i < count; ++i) (*matrix)(rows[i], rows[j]) -= product(i, j);
  }
  return true;
}

}  // namespace

bool FactorizeBlocks(const std::vector<int>& leading_sizes, MatrixXd* matrix) {
  Index offset = 0;
  for (const int size : leading_sizes) {
    if (!EliminateBlock(offset, size, matrix)) return false;
    offset += size;
  }
  const Index rest = matrix->rows() - offset;
  if (rest == 0) return true;
  Eigen::Ref<MatrixXd> corner = matrix->bottomRightCorner(rest, rest);
  const Eigen::LLT<Eigen::Ref<MatrixXd>, Eigen::Lower> dense(corner);
  return dense.info() == Eigen::Success;
}

}  // namespace slcmap
