#include "odometry/window/solver.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options) {
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
    const double predicted = equations.SolveDamped(region.radius());
    double cost = summary.final_cost;
    double gain_ratio = 0;
    if (predicted > 0) {
      equations.Apply();
      cost = equations.Cost();
      gain_ratio = (summary.final_cost - cost) / predicted;
    }
    if (std::isfinite(cost) && gain_ratio > kMinGainRatio) {
      stop = summary.final_cost - cost <= options.function_tolerance * summary.final_cost;
      summary.final_cost = cost;
      region.Accept(gain_ratio);
      rejections = 0;
    } else {
      if (predicted > 0) equations.Undo();
      region.Reject();
      stop = ++rejections > kMaxRejections ||
             predicted <= options.function_tolerance * summary.final_cost;
    }
  }
  return summary;
}

}  // namespace slcmap
