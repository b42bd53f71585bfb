// What is known of the window's states from everything that has left the window.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "odometry/residuals/block_kind.h"

namespace slcmap {

// A linear term in square-root form: |residual + jacobian (x minus x_lin)|^2, where the columns of
// the Jacobian are the tangents of the blocks in their order.
struct Prior {
  std::vector<double*> blocks;  // the parameter blocks it speaks of
  std::vector<BlockKind> kinds;
  std::vector<std::vector<double>> x_lin;  // where each was linearised
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;

  bool empty() const { return blocks.empty(); }
  int TangentOffset(int block) const;
  int TangentTotal() const;
  // x minus x_lin of all blocks at their current values (in `parameters`, in the order of blocks).
  Eigen::VectorXd Difference(const double* const* parameters) const;
};

}  // namespace slcmap
