// Plots of an evaluated trajectory.
#pragma once

#include <string>
#include <vector>

#include "apps/evaluation/trajectory_metrics.h"

namespace slcmap {

// Writes top.svg (x, y) and side.svg (x, z), with the estimate laid over the truth by position and
// yaw, and error.svg (position and rotation error over time) into a folder, which is made where it
// is missing. Returns the files' paths. Throws OutputError.
std::vector<std::string> WriteTrajectoryPlots(const std::string& folder,
                                              const TrajectoryMetrics& metrics);

}  // namespace slcmap
