// Checks of a factor's Jacobians that hold for every factor.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "odometry/factors/factor.h"

namespace slcmap {

using Blocks = std::vector<std::vector<double>>;

inline std::vector<const double*> Pointers(const Blocks& blocks) {
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  return pointers;
}

inline Eigen::VectorXd Residual(const Factor& factor, const Blocks& blocks) {
  Eigen::VectorXd r(factor.rows());
  EXPECT_TRUE(factor.Evaluate(Pointers(blocks).data(), r.data(), nullptr));
  return r;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The residual, and its Jacobians by each block, of its tangent or as Ceres has them.
struct Linearized {
  Linearized(const Factor& factor, const Blocks& blocks, bool of_tangents = true)
      : residual(factor.rows()) {
    std::vector<double*> outputs;
    for (int k = 0; k < factor.blocks(); ++k) {
      jacobians.emplace_back(factor.rows(),
                             of_tangents ? factor.tangent_size(k) : std::ssize(blocks[k]));
    }
    for (RowMajor& jacobian : jacobians) outputs.push_back(jacobian.data());
    if (of_tangents) {
      factor.Linearize(Pointers(blocks).data(), residual.data(), outputs.data());
    } else {
      EXPECT_TRUE(factor.Evaluate(Pointers(blocks).data(), residual.data(), outputs.data()));
    }
  }
  Eigen::VectorXd residual;
  std::vector<RowMajor> jacobians;
};

// Compares the tangent Jacobians with central differences along the tangents.
inline void ExpectJacobiansMatchDifferences(const Factor& factor, const Blocks& blocks,
                                            double tolerance) {
  const auto residual_at = [&](const Blocks& x) {
    Eigen::VectorXd r(factor.rows());
    factor.Linearize(Pointers(x).data(), r.data(), nullptr);
    return r;
  };
  const auto [r, jacobians] = Linearized(factor, blocks);
  EXPECT_LT((r - residual_at(blocks)).norm(), 1e-12 * (1 + r.norm()));

  const double step = 1e-6;
  for (int k = 0; k < factor.blocks(); ++k) {
    for (int d = 0; d < factor.tangent_size(k); ++d) {
      const auto moved = [&](double by) {
        auto x = blocks;
        Eigen::VectorXd delta = Eigen::VectorXd::Zero(factor.tangent_size(k));
        delta[d] = by;
        BlockPlus(factor.kind(k), blocks[k].data(), delta.data(), x[k].data());
        return residual_at(x);
      };
      const Eigen::VectorXd difference = (moved(step) - moved(-step)) / (2 * step);
      const double scale = 1 + difference.norm();
      EXPECT_LT((difference - jacobians[k].col(d)).norm() / scale, tolerance)
          << "block " << k << " dimension " << d << "\ndifferences " << difference.transpose()
          << "\nanalytic    " << jacobians[k].col(d).transpose();
    }
  }
}

inline std::vector<double> PoseBlockOf(const RigidTransform& pose) {
  std::vector<double> block(kPoseSize);
  PoseToBlock(pose, block.data());
  return block;
}

}  // namespace slcmap
