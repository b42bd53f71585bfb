// The lines of a run as what the line stage starts from.
#pragma once

#include <vector>

#include "mapping/lines/building_axes.h"
#include "mapping/lines/line_store.h"
#include "odometry/run.h"

namespace slcmap {

// Those of the run's lines that are known to max_sigma_m and were seen by min_views keyframes, each
// running so that the bright side is on the left of its image. Axes are those of AxesOfRun.
std::vector<TrackedLine> KnownLines(const OdometryRun& run, const std::vector<BuildingAxis>& axes,
                                    double max_sigma_m, int min_views);

}  // namespace slcmap
