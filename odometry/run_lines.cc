#include "odometry/run_lines.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace slcmap {
namespace {

constexpr std::size_t kRecentKeyframes = 10;
constexpr int kLongLife = 10;  // keyframes

int64_t FirstRecentKeyframe(const std::vector<Keyframe>& keyframes) {
  if (keyframes.size() <= kRecentKeyframes) return std::numeric_limits<int64_t>::min();
  return keyframes[keyframes.size() - kRecentKeyframes].id;
}

void RenameMerged(const std::map<int64_t, int64_t>& survivors,
                  std::vector<LineObservation>* observations) {
  for (LineObservation& observation : *observations) {
    const auto survivor = survivors.find(observation.id);
    if (survivor != survivors.end()) observation.id = survivor->second;
  }
  const auto id = [](const LineObservation& observation) { return observation.id; };
  std::ranges::stable_sort(*observations, {}, id);
  const auto rest = std::ranges::unique(*observations, {}, id);
  observations->erase(rest.begin(), rest.end());
}

template <typename Direction>
bool IsWithdrawn(const std::vector<Direction>& directions, int index) {
  const auto i = static_cast<std::size_t>(index);
  return index >= 0 && i < directions.size() && directions[i].withdrawn;
}

bool FollowsWithdrawn(const Line& line, const OdometryRun& run) {
  if (line.axis == LineAxis::kSloped) return IsWithdrawn(run.sloped_directions, line.world);
  return IsWithdrawn(run.manhattan_worlds, line.world);
}

}  // namespace

void ResolveMergedLines(OdometryRun* run) {
  // A line is merged into one of a lower id, so what a chain leads to is already resolved.
  for (auto& [id, survivor] : run->line_merges) {
    const auto next = run->line_merges.find(survivor);
    if (next != run->line_merges.end()) survivor = next->second;
  }
  for (Keyframe& keyframe : run->keyframes) RenameMerged(run->line_merges, &keyframe.lines);
}

double LargestSigma(const Line& line) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(line.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues().z(), 0.0));
}

std::vector<MapLine> MapLines(const OdometryRun& run) {
  const int64_t first_recent = FirstRecentKeyframe(run.keyframes);
  std::vector<MapLine> lines;
  for (const Line& line : run.lines) {
    if (FollowsWithdrawn(line, run)) continue;
    lines.push_back({line.id, line.segment, line.axis, line.world, LargestSigma(line),
                     line.last_keyframe >= first_recent, line.start_world, line.end_world,
                     line.observations, line.deviation_rad, line.deviation_sigma_rad});
  }
  return lines;
}

LineLives MeasureLineLives(const std::vector<Line>& lines) {
  std::vector<int> lives;
  for (const Line& line : lines) lives.push_back(line.observations);
  return LivesOf(std::move(lives));
}

LineLives LivesOf(std::vector<int> lives) {
  if (lives.empty()) return {};
  std::sort(lives.begin(), lives.end());
  const auto count = static_cast<double>(lives.size());
  LineLives result;
  result.lines = static_cast<int64_t>(lives.size());
  result.median_keyframes = 0.5 * (lives[(lives.size() - 1) / 2] + lives[lives.size() / 2]);
  result.mean_keyframes = std::accumulate(lives.begin(), lives.end(), 0.0) / count;
  const auto first_long = std::upper_bound(lives.begin(), lives.end(), kLongLife);
  result.share_over_10 = static_cast<double>(lives.end() - first_long) / count;
  return result;
}

}  // namespace slcmap
