// How a rig's cameras lie to each other.
#pragma once

#include "data/types.h"

namespace slcmap {

// From the right camera to the left one.
inline RigidTransform LeftRight(const Rig& rig) {
  return rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
}

}  // namespace slcmap
