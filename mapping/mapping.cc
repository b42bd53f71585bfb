#include "mapping/mapping.h"

#include "mapping/line_map.h"
#include "mapping/occupancy.h"
#include "mapping/point_cloud.h"
#include "mapping/refinement.h"

namespace slcmap {
namespace {

// Shares of the time, about, up to the end of a stage.
constexpr double kFused = 0.1, kFiltered = 0.3;

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
  map.trajectory = RefineTrajectory(run.states, run.keyframes, &map.warnings);
  map.keyframes = KeyframeTrajectory(run.keyframes);
  map.points = FuseLandmarks(SelectLandmarks(run.landmarks, options.cloud), options.cloud,
                             watched.Part(0, kFused));
  map.points =
      RemoveOutliers(std::move(map.points), options.cloud, watched.Part(kFused, kFiltered));
  map.lines = SelectLines(run, options.lines);
  map.occupancy = MapOccupancy(KeyframeRays(run, map.points), options.occupancy, &map.warnings,
                               watched.Part(kFiltered, 1));
  if (stopped) {
    map.complete = false;
    map.partial_reason += map.partial_reason.empty() ? "" : "; ";
    map.partial_reason += "mapping was interrupted";
  }
  return map;
}

}  // namespace slcmap
