// The lines of a map.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/options.h"
#include "odometry/run.h"

namespace slcmap {

// The run's lines that are certain enough, were seen often enough and have an extent, in their
// order.
std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options);

}  // namespace slcmap
