// The cost of an adjustment as a problem of Ceres', the order in which its normal equations are
// solved, and its solution, which ends when progress says so.
#pragma once

#include <ceres/iteration_callback.h>
#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "data/core/progress.h"
#include "mapping/adjustment/adjustment_state.h"
#include "mapping/adjustment/closure.h"
#include "odometry/factors/factor.h"

namespace slcmap::inline mapping {

class SolverProgress final : public ceres::IterationCallback {
 public:
  SolverProgress(const Progress& progress, int iterations)
      : progress_(progress), iterations_(iterations) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    stopped_ = !progress_.Report(std::min(1.0, 1.0 * summary.iteration / iterations_));
    return stopped_ ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }
  bool stopped() const { return stopped_; }

 private:
  const Progress& progress_;
  int iterations_;
  bool stopped_ = false;
};

// The blocks of `first`, between any two of which there is no term, are group 0; those of `last`,
// which most others are tied to, come last of all. The others come by nested dissection of what the
// elimination of `first` ties together (METIS): where many visits of the same places hang together,
// as a building of rooms does, that fills the equations far less than a minimum degree does. The
// same problem is ordered alike each time, unless another thread calls rand() meanwhile. Throws
// Error where a term binds two blocks of `first`.
std::shared_ptr<ceres::ParameterBlockOrdering> EliminationOrder(const ceres::Problem& problem,
                                                                const std::vector<double*>& first,
                                                                const std::vector<double*>& last);

// What the terms need beside the state; must outlive them.
struct AdjustmentModel {
  AdjustmentModel(const OdometryRun& run, const AdjustmentOptions& options);

  // Losses of closures turn so much further out: at first far, so that wrong ones do not decide
  // where right ones are (graduated non-convexity).
  void GraduateClosures(double factor);

  StereoGeometry points, lines, matched_points;  // with their weights
  double edge_sigma_m = 0;                       // of edges that are one
  std::unique_ptr<ceres::LossFunction> point_loss, line_loss, axis_loss, closure_loss, control_loss;
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

// All terms of a state, of the closures that were not taken back, and of control points. The
// position and the heading of each segment's first pose are held to where they are, which no
// measurement tells.
std::unique_ptr<ceres::Problem> BuildProblem(const AdjustmentModel& model,
                                             const AdjustmentState& state,
                                             const std::vector<Closure>& closures,
                                             const ControlTies& ties = {});

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

}  // namespace slcmap::mapping
