// The lines of a map.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/line_evidence.h"
#include "mapping/map_options.h"
#include "odometry/run.h"

namespace slcmap {

// The run's lines that are certain enough, were seen often enough and have an extent, in their
// order.
std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options);

// What the run knows of some of its lines. Of the direction of a line it knows only how well it is
// known where that is worst, so all directions across the line are given that; lines of which it
// does not know that have no covariance.
LineEvidence EvidenceOf(const std::vector<MapLine>& lines, const OdometryRun& run);

}  // namespace slcmap
