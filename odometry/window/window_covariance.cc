#include "odometry/window/window_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace slcmap {
namespace {

using Eigen::MatrixXd;

// Of a state's own information: added to all where they are dependent but for rounding.
constexpr double kRidge = 1e-9;

// What covariances of landmarks are asked for together with.
bool IsAskedForMost(const BlockKind& kind) {
  return kind.manifold == kPoseKind.manifold || kind.is_calibration;
}

}  // namespace

WindowCovariance::WindowCovariance(const StateInformation& information) {
  Order(information);
  Factorize(information);
}

void WindowCovariance::Order(const StateInformation& information) {
  order_.resize(information.blocks.size());
  std::iota(order_.begin(), order_.end(), size_t{0});
  std::stable_partition(order_.begin(), order_.end(),
                        [&](size_t k) { return !IsAskedForMost(information.kinds[k]); });
  for (const size_t k : order_) {
    const BlockKind& kind = information.kinds[k];
    columns_[information.blocks[k]] = {total_, kind.tangent_size};
    total_ += kind.tangent_size;
    if (!IsAskedForMost(kind)) first_pose_ = total_;
  }
}

void WindowCovariance::Factorize(const StateInformation& information) {
  std::vector<int> from(static_cast<size_t>(total_));  // column of `information`, by our own
  int column = 0;
  for (size_t k = 0; k < information.blocks.size(); ++k) {
    const Columns& ours = columns_.at(information.blocks[k]);
    for (int i = 0; i < ours.count; ++i) from[ours.offset + i] = column++;
  }
  scale_.resize(total_);
  for (int i = 0; i < total_; ++i) {
    const double diagonal = information.matrix(from[i], from[i]);
    scale_[i] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 1;
  }
  factor_ = MatrixXd::Zero(total_, total_);
  for (int j = 0; j < total_; ++j) {
    for (int i = j; i < total_; ++i) {
      const auto [low, high] = std::minmax(from[i], from[j]);
      factor_(i, j) = scale_[i] * information.matrix(high, low) * scale_[j];
    }
  }
  Eigen::LLT<MatrixXd, Eigen::Lower> cholesky(factor_);
  for (double ridge = kRidge; cholesky.info() != Eigen::Success && ridge < 1e-3; ridge *= 100) {
    factor_.diagonal().array() += ridge;
    cholesky.compute(factor_);
  }
  factor_ = cholesky.matrixLLT();
  if (cholesky.info() != Eigen::Success || !factor_.allFinite()) {  // nothing is known
    columns_.clear();
    return;
  }
  const int poses = total_ - first_pose_;
  const MatrixXd inverse = factor_.bottomRightCorner(poses, poses)
                               .triangularView<Eigen::Lower>()
                               .solve(MatrixXd::Identity(poses, poses));
  pose_covariance_ = inverse.transpose() * inverse;
}

// With information L L^T, the covariance of columns S is |L^-1 S|^2; above the first of them L^-1 S
// is zero.
MatrixXd WindowCovariance::Of(const std::vector<const double*>& blocks) const {
  std::vector<int> at;
  for (const double* block : blocks) {
    const Columns& columns = columns_.at(block);
    for (int i = 0; i < columns.count; ++i) at.push_back(columns.offset + i);
  }
  const auto count = static_cast<Eigen::Index>(at.size());
  MatrixXd covariance(count, count);
  const int first = at.empty() ? 0 : *std::min_element(at.begin(), at.end());
  if (first >= first_pose_) {
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index j = 0; j < count; ++j) {
        covariance(i, j) = pose_covariance_(at[i] - first_pose_, at[j] - first_pose_);
      }
    }
  } else {
    MatrixXd selected = MatrixXd::Zero(total_ - first, count);
    for (Eigen::Index i = 0; i < count; ++i) selected(at[i] - first, i) = 1;
    factor_.bottomRightCorner(total_ - first, total_ - first)
        .triangularView<Eigen::Lower>()
        .solveInPlace(selected);
    covariance = selected.transpose() * selected;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    covariance.row(i) *= scale_[at[i]];
    covariance.col(i) *= scale_[at[i]];
  }
  return covariance;
}

}  // namespace slcmap
