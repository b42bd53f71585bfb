// Whether a rig's way stays within its building.
#pragma once

#include "data/simulator/pair_renderer.h"
#include "data/simulator/scene.h"

namespace slcmap {

// Where a way passes through surfaces.
struct WayCrossings {
  int count = 0;
  double first_s = 0;  // of the motion
  Eigen::Vector3d first_place_m = Eigen::Vector3d::Zero();
};

// Follows the left camera from the first frame to the last. Throws ConfigError naming time and
// place where it is beside the scene's surfaces, below them or more than 10 m above, and
// StoppedError where the task's stage ends it.
WayCrossings CheckWay(const Scene& scene, const RenderTask& task);

}  // namespace slcmap
