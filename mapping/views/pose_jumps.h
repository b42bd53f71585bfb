// Where poses that were given jump, as those of a tracker that was lost or of a loop that was
// closed.
#pragma once

#include <vector>

#include "data/trajectory.h"

namespace slcmap {

// A step from one pose to the next that neither the motion before it nor the one after explains.
struct PoseJump {
  int64_t from_ns = 0, stamp_ns = 0;  // of the pose that it starts from, and leads to
  double moved_m = 0;                 // besides the motion, where that explains it best
  double turned_rad = 0;
};

// Only steps of at most half a second are told from motion.
std::vector<PoseJump> JumpsOf(const Trajectory& trajectory);

}  // namespace slcmap
