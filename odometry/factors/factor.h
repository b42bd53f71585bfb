// The base of the estimator's residuals: linear in tangent space, with first-estimate Jacobians;
// the prior, and the terms of what is as given and of standing still.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "odometry/factors/blocks.h"

namespace slcmap::inline odometry {

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

// What is known of the window's states from everything that has left the window.

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

// Block: a calibration block (see blocks.h), whose numbers are corrections of what was given.
// r = weights * x, a row a number; a weight is one over a standard deviation, or 0.
class AsGivenResidual final : public Factor {
 public:
  AsGivenResidual(const BlockKind& kind, const Eigen::VectorXd& weights);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  Eigen::VectorXd weights_;
};

// Blocks: the readout, then those of the residual that it is put around, whose linearisation points
// it keeps. Of a measurement that was brought to its stamp by the readout `at_s` and moves with it:
// r = residual + by_readout (readout - at_s).
class ByReadoutResidual final : public Factor {
 public:
  // by_readout: 1 / s, a row a residual.
  ByReadoutResidual(std::unique_ptr<Factor> residual, const Eigen::VectorXd& by_readout,
                    double at_s);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  std::unique_ptr<Factor> residual_;
  Eigen::VectorXd by_readout_;
  double at_s_;
};

// Block: speed-and-bias. r = v / sigma, three rows.
class ZeroVelocityResidual final : public Factor {
 public:
  explicit ZeroVelocityResidual(double sigma_m_s);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace slcmap::odometry
