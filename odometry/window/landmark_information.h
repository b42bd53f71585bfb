// What terms and the prior know of one landmark, with everything else held as it is.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "odometry/window/problem_builder.h"

namespace slcmap {

// The whitened residual of a term at the current estimate; rows that it does not have are zero.
Eigen::Vector4d ResidualOf(const FixedTerm& term);

// Squared whitened residuals of a stereo observation, left and right apart (right 0 where it was
// not seen).
std::pair<double, double> Chi2OfObservation(const FixedTerm& term);

// The normal equations of a block's tangent, without losses.
struct BlockEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double squared_residuals = 0;
  int rows = 0;
};

// Of the block that the terms share as their last one.
BlockEquations EquationsOnLast(const std::vector<FixedTerm>& terms, int tangent_size);

// The covariance of a line's place across it at one of its points, in the world: rank 2, m^2.
Eigen::Matrix3d CovarianceAcross(const LineLandmark& line, const Eigen::Vector3d& p_world,
                                 const CostModel& model, const Prior& prior);

struct PointPlace {
  Eigen::Vector3d p_world;
  Eigen::Matrix3d covariance_m2;
  double chi2 = 0;  // of the observations about it
  int freedoms = 0;
};

// Where the observations of a triangulated point have it, whatever the lines are that it belongs
// to: one Gauss-Newton step from its estimate. Nothing where they do not tell.
std::optional<PointPlace> PlaceByObservations(const PointLandmark& point, const CostModel& model);

}  // namespace slcmap
