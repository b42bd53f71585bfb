// What a run's images tell of the principal points of its cameras.
#pragma once

#include <optional>

#include "odometry/options.h"
#include "odometry/run.h"

namespace slcmap {

// Fits principal points, beside the right camera's turn and the focal length, to the points that
// keyframes saw: pieces of as many keyframes as a window has, taken evenly from the run, each
// adjusted by itself with poses and points free, and all pieces together then. Nothing of the IMU
// is in it: a principal point looks like a turn of the camera but for what it does far from the
// image's middle, and where the IMU is against the cameras is unknown itself. The standard
// deviations are those of the fit, larger by CalibrationOptions::sigma_scale or by how far the
// pieces disagree.
//
// `given` is the rig as calibrated, that `run.rectified_rig` is the rectified one of. Nothing where
// there is a single camera, or not one piece.
std::optional<PrincipalPoints> FitPrincipalPoints(const Rig& given, const OdometryOptions& options,
                                                  const OdometryRun& run);

}  // namespace slcmap
