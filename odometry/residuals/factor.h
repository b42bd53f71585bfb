// The base of the estimator's residuals: linear in tangent space, with first-estimate Jacobians.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "odometry/residuals/block_kind.h"

namespace slcmap {

// A whitened residual of one to five parameter blocks.
//
// Jacobians are evaluated at the linearisation point of a block where one is set, and at the
// current estimate elsewhere; residuals always at the current estimate. Blocks that the
// marginalisation prior touches have one, so that all terms agree on what cannot be observed
// (first-estimate Jacobians; Huang, Mourikis and Roumeliotis, ISER 2008).
class Factor : public ceres::CostFunction {
 public:
  static constexpr int kMaxBlocks = 5;

  // The point must outlive the factor; null means the current estimate.
  void SetLinearizationPoint(int block, const double* point) { linearization_[block] = point; }

  int rows() const { return num_residuals(); }
  int blocks() const { return static_cast<int>(parameter_block_sizes().size()); }
  const BlockKind& kind(int block) const { return kinds_[block]; }
  int tangent_size(int block) const { return kinds_[block].tangent_size; }

  // Whitened residuals at `parameters`, and Jacobians by each block's tangent (row-major, rows() x
  // tangent_size(k); null where not wanted) at the linearisation points.
  void Linearize(const double* const* parameters, double* residuals, double** jacobians) const;

  // As Ceres wants it: Jacobians by all numbers of a block.
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 protected:
  Factor(int rows, const std::vector<BlockKind>& kinds);

  // Residuals and tangent Jacobians at one and the same point. jacobians may be null, and so may
  // each of its entries.
  virtual void EvaluateAt(const double* const* parameters, double* residuals,
                          double** jacobians) const = 0;

 private:
  std::array<BlockKind, kMaxBlocks> kinds_;
  std::array<const double*, kMaxBlocks> linearization_{};
};

}  // namespace slcmap
