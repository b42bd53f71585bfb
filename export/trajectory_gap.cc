#include "export/trajectory_gap.h"

#include <algorithm>
#include <vector>

namespace slcmap {
namespace {

constexpr double kSteps = 4;  // median ones

}  // namespace

double TrajectoryGap_s(const Trajectory& trajectory, double max_jump_s) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    steps_s.push_back(ToSeconds(trajectory[i].stamp_ns - trajectory[i - 1].stamp_ns));
  }
  if (steps_s.empty()) return max_jump_s;
  const auto middle = steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 2);
  std::nth_element(steps_s.begin(), middle, steps_s.end());
  return std::max(max_jump_s, kSteps * *middle);
}

}  // namespace slcmap
