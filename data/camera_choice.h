// Which cameras of a rig are used, where it has more than two.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/camera.h"
#include "data/rigid_transform.h"

namespace slcmap {

// A camera of a chain as its calibration tells it.
struct ChainCamera {
  int index = 0;  // in "cam0", "cam1", ...
  Camera camera;
  RigidTransform T_imu_camera;
  std::optional<double> time_shift_s;  // stamp on the IMU's clock = camera stamp + this
  std::string place;                   // for messages
  std::string source = {};             // which transforms its pose is from
};

// Positions in the chain of the cameras that are used: those of the `wanted` indices, one or two;
// else the only one, or the two of which the first sees most of what the second one sees, from
// places that are apart. Throws InputFault for wanted cameras that the chain has not.
std::vector<size_t> ChooseCameras(const std::vector<ChainCamera>& chain,
                                  const std::vector<int>& wanted);

}  // namespace slcmap
