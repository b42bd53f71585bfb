#include "odometry/geometry/slope.h"

#include <cmath>

namespace slcmap {

using Eigen::Vector3d;

SlopeBlock SlopeOf(const Vector3d& direction) {
  const Vector3d d = direction.z() < 0 ? Vector3d(-direction) : direction;
  return {std::atan2(d.y(), d.x()), std::atan2(d.z(), d.head<2>().norm())};
}

Vector3d SlopeDirection(const double* slope) {
  const double level = std::cos(slope[1]);
  return {level * std::cos(slope[0]), level * std::sin(slope[0]), std::sin(slope[1])};
}

Matrix32d AxesAcrossSlope(const double* slope) {
  const double c = std::cos(slope[0]), s = std::sin(slope[0]), rise = std::sin(slope[1]);
  Matrix32d across;
  across << Vector3d(-s, c, 0), Vector3d(-rise * c, -rise * s, std::cos(slope[1]));
  return across;
}

}  // namespace slcmap
