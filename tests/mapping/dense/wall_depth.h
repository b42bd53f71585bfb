// The depth of a wall across the optical axis of a small camera.
#pragma once

#include "data/core/camera.h"
#include "mapping/views/stereo_depth.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

inline Camera SmallCamera() { return PinholeCamera(200, 150, 120, 99.5, 74.5); }

// A node every step_px, each sigma_m from where it is said to be.
inline DepthGrid WallAt(double depth_m, double sigma_m, int step_px) {
  DepthGrid grid(SmallCamera(), step_px);
  for (DepthNode& node : grid.nodes) {
    node.inverse_depth = static_cast<float>(1 / depth_m);
    node.sigma = static_cast<float>(sigma_m / (depth_m * depth_m));
  }
  return grid;
}

}  // namespace slcmap::testing
