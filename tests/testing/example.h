// A rig and a motion that need no file, for tests and first experiments.
#pragma once

#include "data/core/types.h"
#include "data/simulator/motion.h"

namespace slcmap {

// A rectified stereo pair of 752x480, f = 435 px, baseline 0.11 m, mounted as EuRoC's left camera
// is (camera right = -y of the imu, camera down = -x), with the noise of its ADIS16448.
Rig ExampleStereoRig();

// A flight through a space of 8 x 6 x 1.5 m about the origin, looking ahead, with the attitude
// swinging as a multicopter's does, after stand_still_s of rest. The motion ends at duration_s.
MotionSpline ExampleFlight(const Rig& rig, double duration_s, double stand_still_s = 0);

}  // namespace slcmap
