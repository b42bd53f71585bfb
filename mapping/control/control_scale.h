// How long the map's metre is, by what a surveyor measured.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "mapping/control/control_points.h"
#include "mapping/control/triangulation.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// How many times longer distances are than a map has them, with its standard deviation.
struct MeasuredScale {
  double times = 1, sigma = 0;
};

// The median of known distances and of those between control points, metres of whose grid are
// `grid_scale` of the ground's, over those of the placed points; nothing where none is in the map.
std::optional<MeasuredScale> MeasureScale(const Control& control,
                                          const std::map<std::string, PlacedPoint>& placed,
                                          double grid_scale);

// The run, so many times larger: what it found, and how far its cameras are apart, which is what
// told it the metre.
void ScaleRun(double times, OdometryRun* run);

}  // namespace slcmap::mapping
