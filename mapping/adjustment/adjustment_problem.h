// The cost of an adjustment as a problem of Ceres', and its solution.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <memory>
#include <vector>

#include "data/progress.h"
#include "mapping/adjustment/adjustment_state.h"
#include "mapping/adjustment/closure.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// What the terms need beside the state; must outlive them.
struct AdjustmentModel {
  AdjustmentModel(const OdometryRun& run, const AdjustmentOptions& options);

  // Losses of closures turn so much further out: at first far, so that wrong ones do not decide
  // where right ones are (graduated non-convexity).
  void GraduateClosures(double factor);

  StereoGeometry points, lines, matched_points;  // with their weights
  double edge_sigma_m = 0;                       // of edges that are one
  std::unique_ptr<ceres::LossFunction> point_loss, line_loss, axis_loss, closure_loss;
  double closure_loss_sigma = 0;
  // One over the standard deviations of the calibration as it was given, and of its ties to that;
  // 0 for none.
  CalibrationVector prior_weights, tie_weights = CalibrationVector::Zero();
};

// A term of Ceres' with the blocks that it binds.
struct AdjustmentTerm {
  std::unique_ptr<Factor> factor;
  ceres::LossFunction* loss = nullptr;  // of the model, null for none
  std::vector<double*> blocks;
};

AdjustmentTerm PointTerm(const AdjustedPoint& point, const AdjustedPointObservation& observation,
                         const AdjustmentState& state, const AdjustmentModel& model);
// `weight` times that of the model.
AdjustmentTerm LineTerm(const AdjustedLine& line, const AdjustedLineObservation& observation,
                        double weight, const AdjustmentState& state, const AdjustmentModel& model);
// Between a keyframe and the one before.
AdjustmentTerm ImuTerm(size_t frame, const AdjustmentState& state);

// Squared whitened residuals at the state: of all rows, and of the first two.
double Chi2(const AdjustmentTerm& term);
double Chi2OfLeft(const AdjustmentTerm& term);

// All terms of a state, and of the closures that were not taken back. The position and the heading
// of each segment's first pose are held to where they are, which no measurement tells.
std::unique_ptr<ceres::Problem> BuildProblem(const AdjustmentOptions& options,
                                             const AdjustmentModel& model,
                                             const AdjustmentState& state,
                                             const std::vector<Closure>& closures);

struct RoundSummary {
  bool usable = false;
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;
};

// Moves the state to where the cost is least, until a step lowers it by no more than the share
// `settled` of it. Points and short lines are eliminated first. Throws StoppedError when progress
// says so.
RoundSummary SolveProblem(const AdjustmentOptions& options, const AdjustmentState& state,
                          const std::vector<Closure>& closures, double settled,
                          ceres::Problem* problem, const Progress& progress);

}  // namespace slcmap
