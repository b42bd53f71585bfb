// The angle between lines, which have no sense of direction.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap {

// From 0 to pi / 2, exact for small angles too. The directions may have any length.
inline double LineAngle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

}  // namespace slcmap
