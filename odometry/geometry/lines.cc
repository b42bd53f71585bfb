#include "odometry/geometry/lines.h"

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap::inline odometry {

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

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;

Vector3d NearestOn(const PointAndDirection& line, const Vector3d& p_world) {
  return line.point_world +
         line.direction_world * line.direction_world.dot(p_world - line.point_world);
}

GeneralLineBlock GeneralLineThrough(const Vector3d& anchor_world, const Vector3d& p_world,
                                    const Vector3d& direction_world) {
  const Vector3d direction = direction_world.normalized();
  const Vector3d moment = (p_world - anchor_world).cross(direction);
  Matrix3d u;
  u.col(0) = moment.normalized();
  u.col(1) = direction;
  u.col(2) = u.col(0).cross(direction);
  GeneralLineBlock block;
  Map<Quaterniond>{block.data()} = Quaterniond(u).normalized();
  block[4] = std::atan2(1.0, moment.norm());
  return block;
}

PointAndDirection GeneralLineFromBlock(const Vector3d& anchor_world, const double* block) {
  const Matrix3d u = Map<const Quaterniond>(block).toRotationMatrix();
  // direction x moment / |direction|^2, from the anchor.
  const double distance = std::cos(block[4]) / std::sin(block[4]);
  return {anchor_world - distance * u.col(2), u.col(1)};
}

// U <- U Exp(d) changes u_k by u_j d_i - u_i d_j for the cyclic (i, j, k).
Eigen::Matrix<double, 3, 4> GeneralLineTurn(const double* block) {
  const Matrix3d u = Map<const Quaterniond>(block).toRotationMatrix();
  Eigen::Matrix<double, 3, 4> turn;
  turn << u.col(2), Vector3d::Zero(), -u.col(0), Vector3d::Zero();
  return turn;
}

Eigen::Matrix<double, 3, 4> GeneralLineShift(const double* block, double along_m) {
  const Matrix3d u = Map<const Quaterniond>(block).toRotationMatrix();
  const double distance = std::cos(block[4]) / std::sin(block[4]);
  Eigen::Matrix<double, 3, 4> shift;
  shift << distance * u.col(1), -distance * u.col(0), Vector3d::Zero(),
      (1 + distance * distance) * u.col(2);
  return shift + along_m * GeneralLineTurn(block);
}

SlopeBlock MakeSlope(const Vector3d& direction) {
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

}  // namespace slcmap::odometry
