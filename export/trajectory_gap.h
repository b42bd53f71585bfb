// Where a trajectory has no poses.
#pragma once

#include "data/trajectory.h"

namespace slcmap {

// The longest time between two poses that a way is drawn across, in seconds: max_jump_s, and more
// where the poses themselves are that rare, as of pairs taken once a second.
double TrajectoryGap_s(const Trajectory& trajectory, double max_jump_s);

}  // namespace slcmap
