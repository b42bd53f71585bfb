// A run made by hand, for the tests of the stages behind odometry.
#pragma once

#include "odometry/run.h"

namespace slcmap::testing {

// A rig that flies 5 m along x at 1 m/s through a room, looking along +x, at 10 Hz with a keyframe
// a second, and sees all 400 landmarks: a grid on the wall x = 10 m. Its final keyframes lie where
// the truth is (y = 0, z = 1 m); its online poses drifted by 2 cm in y a second, from the second 1
// on.
OdometryRun MakeWallRun();

}  // namespace slcmap::testing
