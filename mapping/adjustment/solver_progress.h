// Progress of a solution by Ceres, which ends when progress says so.
#pragma once

#include <ceres/iteration_callback.h>

#include <algorithm>

#include "data/progress.h"

namespace slcmap {

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

}  // namespace slcmap
