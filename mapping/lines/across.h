// Directions across a line.
#pragma once

#include <Eigen/Geometry>

namespace slcmap {

// Two columns, square to the direction (of length 1) and to each other.
inline Eigen::Matrix<double, 3, 2> AcrossOf(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = direction.unitOrthogonal();
  across.col(1) = direction.cross(across.col(0));
  return across;
}

}  // namespace slcmap
