#include "odometry/window/solver.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "odometry/window/normal_equations.h"

namespace slcmap {
namespace {

// The size of the region in which the linear model is trusted (Madsen, Nielsen and Tingleff,
// "Methods for Non-Linear Least Squares Problems", 2004, section 3.2), with Ceres' constants.
class TrustRegion {
 public:
  double radius() const { return radius_; }
  void Accept(double gain_ratio) {
    radius_ /= std::max(1.0 / 3, 1 - std::pow(2 * gain_ratio - 1, 3));
    radius_ = std::min(radius_, 1e16);
    shrink_ = 2;
  }
  void Reject() {
    radius_ /= shrink_;
    shrink_ *= 2;
  }

 private:
  double radius_ = 1e4, shrink_ = 2;
};

// The predicted decrease of the cost, with more damping as long as the system cannot be solved:
// after many good steps the damping may be lost in the rounding of H. Nothing where damping does
// not help.
std::optional<double> SolveDamped(NormalEquations* equations, TrustRegion* region) {
  constexpr int kMaxAttempts = 6;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const std::optional<double> predicted = equations->SolveDamped(region->radius());
    if (predicted) return predicted;
    region->Reject();
  }
  return std::nullopt;
}

}  // namespace

SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options, StateInformation* information) {
  constexpr double kMinGainRatio = 1e-3;
  constexpr int kMaxRejections = 5;  // in a row
  NormalEquations equations(*terms, prior, is_constant);
  TrustRegion region;
  SolverSummary summary;
  summary.initial_cost = summary.final_cost = equations.Cost();
  summary.usable = std::isfinite(summary.initial_cost);
  int rejections = 0;
  bool stop = !summary.usable;
  while (!stop && summary.iterations < options.max_iterations) {
    if (rejections == 0) equations.Linearize();
    ++summary.iterations;
    const std::optional<double> predicted = SolveDamped(&equations, &region);
    if (!predicted) {
      summary.usable = false;
      break;
    }
    equations.Apply();
    const double cost = equations.Cost();
    const double gain_ratio = *predicted > 0 ? (summary.final_cost - cost) / *predicted : 0;
    if (std::isfinite(cost) && gain_ratio > kMinGainRatio) {
      stop = summary.final_cost - cost <= options.function_tolerance * summary.final_cost;
      summary.final_cost = cost;
      region.Accept(gain_ratio);
      rejections = 0;
    } else {
      equations.Undo();
      region.Reject();
      stop = ++rejections > kMaxRejections ||
             *predicted <= options.function_tolerance * summary.final_cost;
    }
  }
  if (information) {
    *information = summary.iterations > 0 ? equations.Information() : StateInformation();
  }
  return summary;
}

}  // namespace slcmap
