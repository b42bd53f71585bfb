#include "odometry/run_points.h"

#include <algorithm>
#include <unordered_map>

namespace slcmap {

PointLives MeasurePointLives(const std::vector<Keyframe>& keyframes) {
  std::unordered_map<int64_t, int> seen;
  for (const Keyframe& keyframe : keyframes) {
    for (const KeyframeObservation& observation : keyframe.observations) {
      ++seen[observation.landmark_id];
    }
  }
  const auto once =
      std::count_if(seen.begin(), seen.end(), [](const auto& point) { return point.second == 1; });
  return {static_cast<int64_t>(seen.size()), once};
}

}  // namespace slcmap
