#include "odometry/geometry/general_line.h"

#include <Eigen/Geometry>
#include <cmath>

namespace slcmap {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

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

}  // namespace slcmap
