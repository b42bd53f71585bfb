#include "odometry/run_lines.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace slcmap {
namespace {

constexpr std::size_t kRecentKeyframes = 10;
constexpr int kLongLife = 10;  // keyframes

int64_t FirstRecentKeyframe(const std::vector<Keyframe>& keyframes) {
  if (keyframes.size() <= kRecentKeyframes) return std::numeric_limits<int64_t>::min();
  return keyframes[keyframes.size() - kRecentKeyframes].id;
}

}  // namespace

double LargestSigma(const Line& line) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(line.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues().z(), 0.0));
}

std::vector<MapLine> MapLines(const OdometryRun& run) {
  const int64_t first_recent = FirstRecentKeyframe(run.keyframes);
  std::vector<MapLine> lines;
  for (const Line& line : run.lines) {
    lines.push_back({line.id, line.segment, line.axis, line.world, LargestSigma(line),
                     line.last_keyframe >= first_recent, line.start_world, line.end_world});
  }
  return lines;
}

LineLives MeasureLineLives(const std::vector<Line>& lines) {
  if (lines.empty()) return {};
  std::vector<int> lives;
  for (const Line& line : lines) lives.push_back(line.observations);
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
