// How a rig's cameras lie to each other.
#pragma once

#include "data/types.h"

namespace slcmap {

// The figure that says how well left and right images agree, in %.
inline constexpr const char* kAgreeingMatches = "matches that agree with calibration";

// From the right camera to the left one.
inline RigidTransform LeftRight(const Rig& rig) {
  return rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
}

}  // namespace slcmap
