// Folds states and landmarks that leave the window into the prior; and how well the states of a
// window are known, against each other.
#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

#include "odometry/factors/factor.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// The information on a window's state blocks, once its points are eliminated.
struct StateInformation {
  std::vector<const double*> blocks;
  std::vector<BlockKind> kinds;
  Eigen::MatrixXd matrix;  // lower triangle, over the blocks' tangents in their order
};

// Covariances of states, each with all others unknown (marginal, not conditional). Position and
// heading of the whole window are known by the prior of the segment's first frame and what has
// drifted since, so what is compared is to be counted from a pose of the window.
class WindowCovariance {
 public:
  explicit WindowCovariance(const StateInformation& information);

  bool Knows(const double* block) const { return columns_.contains(block); }

  // The joint covariance of the tangents of some blocks that it knows, in the order given.
  Eigen::MatrixXd Of(const std::vector<const double*>& blocks) const;

 private:
  struct Columns {
    int offset = 0, count = 0;
  };
  void Order(const StateInformation& information);
  void Factorize(const StateInformation& information);

  // The blocks in the order in which they are eliminated: poses and
  // calibration, which are asked for most, last.
  std::vector<size_t> order_;
  std::unordered_map<const double*, Columns> columns_;
  int total_ = 0, first_pose_ = 0;
  Eigen::VectorXd scale_;            // times a tangent: of unit information
  Eigen::MatrixXd factor_;           // lower, of the scaled information
  Eigen::MatrixXd pose_covariance_;  // of the scaled tangents
};

// The prior on the remaining blocks that is left of `prior` and `terms` once `dropped` (state
// blocks) and every landmark that the terms speak of are marginalised. In square-root form:
// landmarks are removed by projection on the null space of their columns, states by a QR
// decomposition (Demmel et al., "Square Root Marginalization for Sliding-Window Bundle Adjustment",
// ICCV 2021).
//
// Blocks without a linearisation point are linearised at their current values; the returned prior's
// x_lin says where each was. Robust losses enter as weights at the current residuals.
Prior Marginalize(const std::vector<Term>& terms, const Prior& prior,
                  const std::vector<double*>& dropped);

}  // namespace slcmap::odometry
