// Where the rectified cameras of all views are.
#pragma once

#include <array>
#include <vector>

#include "mapping/views/view.h"

namespace slcmap {

struct ViewCameras {
  std::array<Camera, 2> cameras;
  std::vector<std::array<RigidTransform, 2>> T_camera_world;  // by view, left and right

  ViewCameras(const Views& views, const Rig& rig) : cameras(rig.cameras) {
    for (const View& view : views) {
      T_camera_world.push_back(
          {WorldFromCamera(view, rig, 0).Inverse(), WorldFromCamera(view, rig, 1).Inverse()});
    }
  }

  Eigen::Vector3d Centre(int view, int camera = 0) const {
    return T_camera_world[view][camera].Inverse().translation;
  }
};

}  // namespace slcmap
