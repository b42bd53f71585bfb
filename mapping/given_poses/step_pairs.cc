#include "mapping/given_poses/step_pairs.h"

#include <algorithm>
#include <cmath>

#include "data/quantile.h"

namespace slcmap {
namespace {

constexpr double kGap_s = 0.25, kNearPose_s = 0.005;  // between poses, to the nearest one

std::optional<RigidTransform> PoseNear(const Trajectory& trajectory, int64_t stamp_ns) {
  if (const auto pose = PoseAt(trajectory, stamp_ns, kGap_s)) return pose;
  const auto is_before = [](const StampedPose& pose, int64_t ns) { return pose.stamp_ns < ns; };
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp_ns, is_before);
  const int64_t most_ns = ToNanoseconds(kNearPose_s);
  if (after != trajectory.end() && after->stamp_ns - stamp_ns <= most_ns) return after->T_world_imu;
  if (after != trajectory.begin() && stamp_ns - std::prev(after)->stamp_ns <= most_ns) {
    return std::prev(after)->T_world_imu;
  }
  return std::nullopt;
}

}  // namespace

std::vector<StepPair> PairsAt(const Trajectory& trajectory, const std::vector<BodyStep>& steps,
                              int64_t offset_ns) {
  std::vector<StepPair> pairs;
  for (const BodyStep& step : steps) {
    const auto from = PoseNear(trajectory, step.from_ns - offset_ns);
    if (!from) continue;
    const auto to = PoseNear(trajectory, step.to_ns - offset_ns);
    if (to) pairs.push_back({step, from->Inverse() * *to, to->rotation});
  }
  return pairs;
}

double ScaleOf(const std::vector<StepPair>& pairs, double* sigma) {
  std::vector<std::pair<double, double>> ratios;  // with weights
  double sum = 0;
  for (const StepPair& pair : pairs) {
    const double way2 = pair.posed.translation.squaredNorm();
    if (way2 < 1e-12) continue;
    ratios.emplace_back(pair.known.T_from_to.translation.dot(pair.posed.translation) / way2,
                        pair.known.T_from_to.translation.norm());
    sum += ratios.back().second;
  }
  *sigma = INFINITY;
  if (ratios.size() < kLeastSteps || !(sum > 0)) return 1;
  std::ranges::sort(ratios);
  const auto quantile = [&](double share) {
    double below = 0;
    for (const auto& [ratio, weight] : ratios) {
      if ((below += weight) >= share * sum) return ratio;
    }
    return ratios.back().first;
  };
  const double spread = 0.74 * (quantile(0.75) - quantile(0.25));
  *sigma = 1.25 * spread / std::sqrt(static_cast<double>(ratios.size()));
  return quantile(0.5);
}

PoseOff OffOf(const std::vector<StepPair>& pairs, double scale) {
  constexpr double kMostSigmas = 8;
  PoseOff off;
  std::vector<double> turns_rad, ways_m;
  double sum = 0;
  for (const StepPair& pair : pairs) {
    turns_rad.push_back(pair.known.T_from_to.rotation.angularDistance(pair.posed.rotation));
    ways_m.push_back((pair.known.T_from_to.translation - scale * pair.posed.translation).norm());
    sum += std::min(kMostSigmas,
                    std::hypot(turns_rad.back() / kTurnSigma_rad, ways_m.back() / kWaySigma_m));
  }
  off.steps = static_cast<int>(std::ssize(pairs));
  off.turn_rad = Quantile(turns_rad, 0.5);
  off.way_m = Quantile(ways_m, 0.5);
  off.cost = pairs.empty() ? kMostSigmas : sum / static_cast<double>(pairs.size());
  return off;
}

}  // namespace slcmap
