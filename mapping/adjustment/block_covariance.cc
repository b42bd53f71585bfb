#include "mapping/adjustment/block_covariance.h"

#include <ceres/crs_matrix.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>

namespace slcmap {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr double kOfNothing = 1e-9;  // of what a number's own observations say of it

struct Columns {
  int first = 0, count = 0;
};

// The Jacobian at the problem's state, and where the columns of the wanted blocks are.
SparseMatrix JacobianOf(ceres::Problem* problem, const std::vector<double*>& blocks,
                        std::vector<Columns>* wanted) {
  ceres::Problem::EvaluateOptions options;
  problem->GetParameterBlocks(&options.parameter_blocks);
  ceres::CRSMatrix rows;
  problem->Evaluate(options, nullptr, nullptr, nullptr, &rows);
  wanted->assign(blocks.size(), {});
  int column = 0;
  for (double* block : options.parameter_blocks) {
    const int count = problem->ParameterBlockTangentSize(block);
    const auto it = std::ranges::find(blocks, block);
    if (it != blocks.end()) {
      (*wanted)[static_cast<size_t>(it - blocks.begin())] = {column, count};
    }
    column += count;
  }
  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(rows.num_rows, rows.num_cols, std::ssize(rows.values),
                                    rows.rows.data(), rows.cols.data(), rows.values.data());
}

}  // namespace

Eigen::MatrixXd BlockCovariance(ceres::Problem* problem, const std::vector<double*>& blocks) {
  std::vector<Columns> wanted;
  SparseMatrix jacobian = JacobianOf(problem, blocks, &wanted);
  // In units of what each number's own observations say of it: what is held has a millionth of the
  // standard deviation of others.
  Eigen::VectorXd scale(jacobian.cols());
  for (int k = 0; k < jacobian.outerSize(); ++k) {
    const double norm = jacobian.col(k).norm();
    if (!(norm > 0)) return {};
    scale[k] = 1 / norm;
  }
  jacobian = jacobian * scale.asDiagonal();
  SparseMatrix information(jacobian.cols(), jacobian.cols());
  information.selfadjointView<Eigen::Lower>().rankUpdate(SparseMatrix(jacobian.transpose()));
  // What nothing says of a block says nothing of others either.
  for (Eigen::Index k = 0; k < information.cols(); ++k) information.coeffRef(k, k) += kOfNothing;
  const Eigen::SimplicialLDLT<SparseMatrix> cholesky(information);
  if (cholesky.info() != Eigen::Success) return {};
  Eigen::Index size = 0;
  for (const Columns& columns : wanted) size += columns.count;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(information.cols(), size);
  Eigen::Index next = 0;
  for (const Columns& columns : wanted) {
    for (int i = 0; i < columns.count; ++i)
      units(columns.first + i, next++) = scale[columns.first + i];
  }
  const Eigen::MatrixXd solved = cholesky.solve(units);
  Eigen::MatrixXd covariance = units.transpose() * solved;
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0) return {};
  const Eigen::VectorXd own = units.colwise().squaredNorm();  // by their own observations
  if ((covariance.diagonal().array() > 0.1 / kOfNothing * own.array()).any()) return {};
  return covariance;
}

}  // namespace slcmap
