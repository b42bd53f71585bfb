// The depth of a wall across the optical axis of a small camera.
#pragma once

#include "data/core/camera.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap::testing {

inline Camera SmallCamera() {
  Camera camera;
  camera.width_px = 200;
  camera.height_px = 150;
  camera.fx_px = camera.fy_px = 120;
  camera.cx_px = 99.5;
  camera.cy_px = 74.5;
  return camera;
}

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
