// Minimises terms and a prior over the parameter blocks they bind.
#pragma once

#include <functional>
#include <vector>

#include "odometry/window/problem_builder.h"
#include "odometry/window/window_covariance.h"

namespace slcmap {

struct SolverOptions {
  int max_iterations = 6;
  double function_tolerance = 1e-4;  // relative change of the cost at which it stops
};

struct SolverSummary {
  // False where the cost is not finite, or a linear system could not be solved however much it was
  // damped. The blocks are then where the last step that lowered the cost has left them.
  bool usable = false;
  int iterations = 0;  // steps that were tried
  double initial_cost = 0, final_cost = 0;
};

// Moves every block that is not constant, by Levenberg-Marquardt on the normal equations (trust
// region and stopping as in Ceres). Points are eliminated first, by their Schur complement.
//
// The terms are Ceres' cost functions, losses and manifolds, but not its solver: the prior is one
// dense term over all states and lines of the window, whose normal matrix is constant here and
// would be built anew, block by block, in each of Ceres' iterations. One thread, and no limit on
// time: the result depends on the input alone.
//
// `information` becomes what the last system says of the states, where it is wanted and there was
// one.
SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options, StateInformation* information = nullptr);

}  // namespace slcmap
