#include "export/trajectory_gap.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "data/quantile.h"

namespace slcmap {
namespace {

constexpr double kMedianSteps = 4;  // median ones

}  // namespace

double TrajectoryGap_s(const Trajectory& trajectory, double max_jump_s) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    steps_s.push_back(ToSeconds(trajectory[i].stamp_ns - trajectory[i - 1].stamp_ns));
  }
  return std::max(max_jump_s, kMedianSteps * Quantile(std::move(steps_s), 0.5));
}

}  // namespace slcmap
