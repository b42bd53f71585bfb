// Minimises terms and a prior over the parameter blocks they bind.
#pragma once

#include <functional>
#include <vector>

#include "odometry/window/problem_builder.h"

namespace slcmap {

struct SolverOptions {
  int max_iterations = 6;
  double function_tolerance = 1e-4;  // relative change of the cost at which it stops
};

struct SolverSummary {
  bool usable = false;  // false where the solver failed or left something not finite
  int iterations = 0;
  double final_cost = 0;
};

// Moves every block that is not constant. Landmarks (point blocks) are eliminated first. One
// thread, and no limit on time: the result depends on the input alone.
SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options);

}  // namespace slcmap
