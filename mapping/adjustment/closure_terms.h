// The terms of recognised places, and whether they can be believed; and how well an adjustment
// knows some of its blocks.
#pragma once

#include <ceres/problem.h>

#include <Eigen/Core>
#include <vector>

#include "mapping/adjustment/adjustment_problem.h"
#include "mapping/adjustment/closure.h"

namespace slcmap::inline mapping {

// The joint covariance of the tangents of some blocks, all others marginalised, at the problem's
// state, with robust losses as weights. Of size 0 where the problem does not determine it.
Eigen::MatrixXd BlockCovariance(ceres::Problem* problem, const std::vector<double*>& blocks);

AdjustmentTerm PointMatchTerm(const PointMatch& match, const AdjustmentState& state,
                              const AdjustmentModel& model);
AdjustmentTerm EdgeMatchTerm(const EdgeMatch& match, const AdjustmentState& state,
                             const AdjustmentModel& model);

// The terms of all closures that were not taken back.
void AddClosureTerms(const std::vector<Closure>& closures, const AdjustmentState& state,
                     const AdjustmentModel& model, ceres::Problem* problem);

// Takes out the matches that are farther from where the state has them than odometry may have
// drifted over the path between the visits, and takes back the closures that lose most of theirs:
// whoever found them, no closure moves a visit by more. Returns how many it has taken back.
int RefuseBeyondGate(const ClosureOptions& options, const AdjustmentState& state,
                     const AdjustmentModel& model, std::vector<Closure>* closures);

// The squared residual of odometry's link from the keyframe before, for each keyframe; 0 where
// there is none.
std::vector<double> LinkChi2(const AdjustmentState& state);

// Takes back the closures most of whose matches do not fit once all is adjusted, and, where a link
// of odometry has become unlikely by them, the one that fits worst of those across it. `links`
// are those before there were closures. Returns how many it has taken back.
int TakeBackClosures(const std::vector<double>& links, const AdjustmentState& state,
                     const AdjustmentModel& model, std::vector<Closure>* closures);

}  // namespace slcmap::mapping
