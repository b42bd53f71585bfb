// A camera that stands still and looks along x, and walls in front of it.
#pragma once

#include <vector>

#include "apps/evaluation/truth.h"
#include "data/core/types.h"
#include "data/io/trajectory.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

// A square of two triangles, side 2 * half, at x = at_m, facing along x.
inline std::vector<Triangle> WallAtX(double at_m, double half_m) {
  const Eigen::Vector3d a(at_m, -half_m, -half_m), b(at_m, half_m, -half_m);
  const Eigen::Vector3d c(at_m, half_m, half_m), d(at_m, -half_m, half_m);
  return {{a, b, c}, {a, c, d}};
}

inline Rig ForwardRig() {
  Rig rig;
  rig.cameras.assign(2, PinholeCamera(320, 240, 200, 159.5, 119.5));
  rig.T_imu_camera[0].rotation = Eigen::Quaterniond(
      (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());  // looks along x
  rig.T_imu_camera[1] = rig.T_imu_camera[0];
  return rig;
}

// At the origin, 20 poses a second.
inline Trajectory Standing(double seconds) {
  Trajectory trajectory;
  for (int i = 0; 0.05 * i < seconds + 0.01; ++i) {
    trajectory.push_back({ToNanoseconds(0.05 * i), RigidTransform()});
  }
  return trajectory;
}

}  // namespace slcmap::testing
