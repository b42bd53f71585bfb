// From what keyframes saw to the observations of a map's points.
#pragma once

#include <vector>

#include "mapping/map.h"
#include "odometry/run.h"

namespace slcmap {

// What the run's keyframes saw of the landmarks that points were fused of, a track a landmark, in
// the images that a rig has (the run's own, or that of images rectified with the calibration that
// was found). The run's calibration is taken into account.
std::vector<MapPointObservation> ObservationsOf(const std::vector<MapPoint>& points,
                                                const OdometryRun& run, const Rig& rig);

}  // namespace slcmap
