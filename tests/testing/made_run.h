// A run made by hand, for the tests of the stages behind odometry.
#pragma once

#include "odometry/run/run.h"

namespace slcmap::testing {

// A rig that flies 5 m along x at 1 m/s through a room, looking along +x, at 10 Hz with a keyframe
// a second, and sees all 400 landmarks: a grid on the wall x = 10 m. Its final keyframes lie where
// the truth is (y = 0, z = 1 m); its online poses drifted by 2 cm in y a second, from the second 1
// on.
OdometryRun MakeWallRun();

// The same with lines on that wall, all seen whole by the first three keyframes: 20 vertical ones
// 0.2 m apart, from z = 0.02 m to 1.92 m through the landmarks, which belong to them; and four
// along Y, the axis of a Manhattan world that is the world's. Ids start at 100. The
// keyframe at 5 s sees the vertical ones again.
OdometryRun MakeLineRun();

// Where such a run could come from: its raw cameras are the rectified ones, and each keyframe has a
// pair of images.
RunSource MakeSource(const OdometryRun& run);

}  // namespace slcmap::testing
