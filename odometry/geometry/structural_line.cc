#include "odometry/geometry/structural_line.h"

#include <cmath>

namespace slcmap {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d AxisDirection(LineAxis axis, double heading_rad) {
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  if (axis == LineAxis::kX) return {c, s, 0};
  if (axis == LineAxis::kY) return {-s, c, 0};
  return Vector3d::UnitZ();
}

Matrix32d AxesAcross(LineAxis axis, double heading_rad) {
  Matrix32d across;
  if (axis == LineAxis::kVertical) {
    across << Vector3d::UnitX(), Vector3d::UnitY();
  } else {
    const LineAxis other = axis == LineAxis::kX ? LineAxis::kY : LineAxis::kX;
    across << AxisDirection(other, heading_rad), Vector3d::UnitZ();
  }
  return across;
}

Vector3d CrossingPoint(const StructuralLine& line, double heading_rad, const double* block) {
  const Vector2d crossing = Vector2d(std::cos(block[0]), std::sin(block[0])) / block[1];
  return line.anchor_world + AxesAcross(line.axis, heading_rad) * crossing;
}

StructuralLineBlock StructuralLineThrough(const StructuralLine& line, double heading_rad,
                                          const Vector3d& p_world) {
  const Vector2d crossing =
      AxesAcross(line.axis, heading_rad).transpose() * (p_world - line.anchor_world);
  return {std::atan2(crossing.y(), crossing.x()), 1.0 / crossing.norm()};
}

}  // namespace slcmap
