// Checks of a factor's Jacobians that hold for every factor.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "odometry/factors/factor.h"

namespace slcmap {

// Compares the tangent Jacobians with central differences along the tangents.
inline void ExpectJacobiansMatchDifferences(const Factor& factor,
                                            std::vector<std::vector<double>> blocks,
                                            double tolerance) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto residual_at = [&](const std::vector<std::vector<double>>& x) {
    std::vector<const double*> pointers;
    for (const auto& block : x) pointers.push_back(block.data());
    Eigen::VectorXd r(factor.rows());
    factor.Linearize(pointers.data(), r.data(), nullptr);
    return r;
  };
  std::vector<const double*> pointers;
  for (const auto& block : blocks) pointers.push_back(block.data());
  std::vector<RowMajor> jacobians;
  std::vector<double*> outputs;
  for (int k = 0; k < factor.blocks(); ++k) {
    jacobians.emplace_back(factor.rows(), factor.tangent_size(k));
  }
  for (auto& j : jacobians) outputs.push_back(j.data());
  Eigen::VectorXd r(factor.rows());
  factor.Linearize(pointers.data(), r.data(), outputs.data());
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
