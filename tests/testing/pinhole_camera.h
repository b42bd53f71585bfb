// A camera for tests.
#pragma once

#include "data/core/camera.h"

namespace slcmap::testing {

// Without distortion, with one focal length for both axes.
inline Camera PinholeCamera(int width_px, int height_px, double focal_px, double cx_px,
                            double cy_px) {
  Camera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = cx_px;
  camera.cy_px = cy_px;
  return camera;
}

}  // namespace slcmap::testing
