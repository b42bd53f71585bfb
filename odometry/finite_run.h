// Keeps values that are not finite out of what odometry hands on.
#pragma once

#include "odometry/run.h"

namespace slcmap {

bool IsFinite(const OdometryRun& run);

// Leaves out states, keyframes, their observations, landmarks, lines and Manhattan worlds that hold
// a value that is not finite (with a world, the lines along its axes), and counts them in warnings.
OdometryRun WithoutNonFinite(OdometryRun run);

}  // namespace slcmap
