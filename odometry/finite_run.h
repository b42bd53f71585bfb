// Keeps values that are not finite, or beyond what run_rows.h allows, out of what odometry hands
// on.
#pragma once

#include "odometry/run.h"

namespace slcmap {

bool IsFinite(const OdometryRun& run);

// Leaves out states, keyframes, their observations, landmarks, lines and Manhattan worlds that hold
// a value that is not finite or absurdly large (with a world, the lines along its axes), and counts
// them in warnings.
OdometryRun WithoutNonFinite(OdometryRun run);

}  // namespace slcmap
