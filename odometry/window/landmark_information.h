// What terms, prior and window know of one landmark.
//
// Two kinds of covariance: the conditional one, with all poses held as they are, is what the
// landmark's own observations say; the one counted from a keyframe takes in how well poses, heading
// and other landmarks are known, and is what a map needs.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "odometry/structure/building_deviation.h"
#include "odometry/window/marginalization.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// The whitened residual of a term at the current estimate; rows that it does not have are zero.
Eigen::Vector4d ComputeResidual(const FixedTerm& term);

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

// The covariance of a triangulated point's place counted from its host, in the axes of the world,
// m^2. What lines that it belongs to add is left out. Nothing where that is not known.
std::optional<Eigen::Matrix3d> CovarianceFromHost(const PointLandmark& point,
                                                  const CostModel& model,
                                                  const WindowCovariance& window);

// The covariance of a line's place across it at one of its points, counted from a keyframe of the
// window: in the axes of the world, rank 2, m^2. Nothing where that is not known.
std::optional<Eigen::Matrix3d> CovarianceAcross(const LineLandmark& line,
                                                const Eigen::Vector3d& p_world,
                                                const FrameState& from,
                                                const WindowCovariance& window);

// The same with all poses and the heading held as they are.
Eigen::Matrix3d ConditionalCovarianceAcross(const LineLandmark& line,
                                            const Eigen::Vector3d& p_world, const CostModel& model,
                                            const Prior& prior);

// The direction of a line that may deviate from its axis or slope, against that. Nothing where it
// is not known.
std::optional<LineDeviation> DeviationFromAxis(const LineLandmark& line,
                                               const WindowCovariance& window);

struct PointPlace {
  Eigen::Vector3d p_world;
  Eigen::Matrix3d covariance_m2;  // conditional
  double chi2 = 0;                // of the observations about it
  int freedoms = 0;
};

// Where the observations of a triangulated point have it, whatever the lines are that it belongs
// to: one Gauss-Newton step from its estimate. Nothing where they do not tell.
std::optional<PointPlace> PlaceByObservations(const PointLandmark& point, const CostModel& model);

}  // namespace slcmap::odometry
