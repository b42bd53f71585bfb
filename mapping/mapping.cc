#include "mapping/mapping.h"

#include <spdlog/spdlog.h>

#include "mapping/adjustment/adjustment.h"
#include "mapping/line_map.h"
#include "mapping/occupancy.h"
#include "mapping/point_cloud.h"
#include "mapping/refinement.h"
#include "odometry/calibrated_rig.h"

namespace slcmap {
namespace {

// Shares of the time, about, up to the end of a stage.
constexpr double kAdjusted = 0.6, kFused = 0.65, kFiltered = 0.75;

// The run as the adjustment over all its keyframes has it; as it is where there is nothing to
// adjust, which is counted, or where progress ends that.
OdometryRun Adjusted(const OdometryRun& run, const AdjustmentOptions& options,
                     const Progress& progress, MapResult* map) {
  OdometryRun adjusted = run;
  if (!options.enabled || run.keyframes.empty()) return adjusted;
  try {
    const AdjustmentResult result = Adjust(run, options, nullptr, progress);
    if (!result.usable) {
      ++map->warnings["not adjusted: " + result.reason];
      spdlog::warn("keyframes are not adjusted: {}", result.reason);
      return adjusted;
    }
    Apply(result, &adjusted);
    map->adjustment = result.figures;
  } catch (const StoppedError&) {
    spdlog::debug("the adjustment was interrupted");
  }
  return adjusted;
}

}  // namespace

MapResult BuildMap(const OdometryRun& run, const MappingOptions& options,
                   const Progress& progress) {
  options.Check();
  MapResult map;
  map.source.run_id = run.id;
  map.source.options = options.ToYaml();
  if (run.source) {
    map.source.sequence = run.source->sequence;
    map.source.version = run.source->version;
  }
  map.method = run.method;
  map.complete = run.complete;
  map.partial_reason = run.partial_reason;
  map.warnings = run.warnings;
  map.verdict = run.verdict;
  map.rectified_rig = run.rectified_rig;

  bool stopped = false;
  const Progress watched([&](double done) {
    stopped = stopped || !progress.Report(done);
    return !stopped;
  });
  const OdometryRun adjusted = Adjusted(run, options.adjustment, watched.Part(0, kAdjusted), &map);
  if (run.source && !adjusted.calibration.empty()) {
    map.calibrated_rig =
        CalibratedRig(run.source->raw_rig, run.rectified_rig, adjusted.calibration.back());
  }
  map.trajectory = RefineTrajectory(run.states, adjusted.keyframes, &map.warnings);
  map.keyframes = KeyframeTrajectory(adjusted.keyframes);
  map.points = FuseLandmarks(SelectLandmarks(adjusted.landmarks, options.cloud), options.cloud,
                             watched.Part(kAdjusted, kFused));
  map.points =
      RemoveOutliers(std::move(map.points), options.cloud, watched.Part(kFused, kFiltered));
  map.lines = SelectLines(adjusted, options.lines);
  map.occupancy = MapOccupancy(KeyframeRays(adjusted, map.points), options.occupancy, &map.warnings,
                               watched.Part(kFiltered, 1));
  if (stopped) {
    map.complete = false;
    map.partial_reason += map.partial_reason.empty() ? "" : "; ";
    map.partial_reason += "mapping was interrupted";
  }
  return map;
}

}  // namespace slcmap
