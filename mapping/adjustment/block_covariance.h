// How well an adjustment knows some of its blocks.
#pragma once

#include <ceres/problem.h>

#include <Eigen/Core>
#include <vector>

namespace slcmap {

// The joint covariance of the tangents of some blocks, all others marginalised, at the problem's
// state, with robust losses as weights. Of size 0 where the problem does not determine it.
Eigen::MatrixXd BlockCovariance(ceres::Problem* problem, const std::vector<double*>& blocks);

}  // namespace slcmap
