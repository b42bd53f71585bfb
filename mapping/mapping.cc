#include "mapping/mapping.h"

#include "mapping/line_map.h"
#include "mapping/occupancy.h"
#include "mapping/point_cloud.h"
#include "mapping/refinement.h"

namespace slcmap {

MapResult BuildMap(const OdometryRun& run, const MappingOptions& options) {
  options.Check();
  MapResult map;
  map.method = run.method;
  map.complete = run.complete;
  map.partial_reason = run.partial_reason;
  map.warnings = run.warnings;
  map.rectified_rig = run.rectified_rig;

  map.trajectory = RefineTrajectory(run.states, run.keyframes);
  map.keyframes = KeyframeTrajectory(run.keyframes);
  map.points = FuseLandmarks(SelectLandmarks(run.landmarks, options.cloud), options.cloud);
  map.points = RemoveOutliers(std::move(map.points), options.cloud);
  map.lines = SelectLines(run, options.lines);
  map.occupancy = MapOccupancy(run, map.points, options.occupancy);
  return map;
}

}  // namespace slcmap
