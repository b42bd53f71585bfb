#include "mapping/line_map.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "odometry/run_lines.h"

namespace slcmap {
namespace {

constexpr double kMostTurn_rad = 1;  // larger standard deviations of a direction say nothing of it

// Whether the run knows how well it knows a line; of the direction of one without an axis it says
// nothing.
bool HasCovariance(const Line& line) {
  return line.axis != LineAxis::kNone && line.deviation_sigma_rad < kMostTurn_rad &&
         line.covariance_m2.diagonal().minCoeff() >= 0;
}

LineCovariance CovarianceOf(const Line& line) {
  const Eigen::Vector3d half = 0.5 * (line.end_world - line.start_world);
  const Eigen::Vector3d along = half.normalized();
  const double turn_m = half.norm() * line.deviation_sigma_rad;  // what turning moves an end by
  const Eigen::Matrix3d turn_m2 =
      turn_m * turn_m * (Eigen::Matrix3d::Identity() - along * along.transpose());
  const Eigen::Matrix3d end_m2 = line.covariance_m2 + turn_m2;
  return {line.id, 0, end_m2, end_m2, line.covariance_m2 - turn_m2};
}

void AddSupports(const Keyframe& keyframe, const LineObservation& seen,
                 std::vector<LineSupport>* supports) {
  supports->push_back({seen.id, 0, keyframe.stamp_ns, 0, seen.left_px});
  if (seen.right_px) supports->push_back({seen.id, 0, keyframe.stamp_ns, 1, *seen.right_px});
}

}  // namespace

std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options) {
  std::vector<MapLine> selected;
  for (const MapLine& line : MapLines(run)) {
    // Comparisons with a value that is not finite fail.
    const bool has_extent = (line.end_world - line.start_world).squaredNorm() > 0;
    if (has_extent && line.sigma_m <= options.max_sigma_m &&
        line.observations >= options.min_observations) {
      selected.push_back(line);
    }
  }
  return selected;
}

LineEvidence EvidenceOf(const std::vector<MapLine>& lines, const OdometryRun& run) {
  std::map<int64_t, const Line*> of_run;
  for (const Line& line : run.lines) of_run[line.id] = &line;
  LineEvidence evidence;
  std::map<int64_t, const Line*> chosen;
  for (const MapLine& line : lines) chosen.insert(*of_run.find(line.id));
  for (const auto& [id, line] : chosen) {
    if (HasCovariance(*line)) evidence.covariances.push_back(CovarianceOf(*line));
  }
  for (const Keyframe& keyframe : run.keyframes) {
    for (const LineObservation& seen : keyframe.lines) {
      if (chosen.contains(seen.id)) AddSupports(keyframe, seen, &evidence.supports);
    }
  }
  std::ranges::sort(evidence.supports, {}, [](const LineSupport& support) {
    return std::tuple(support.line_id, support.stamp_ns, support.camera);
  });
  return evidence;
}

}  // namespace slcmap
