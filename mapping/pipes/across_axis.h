// Places as seen along an axis.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "odometry/geometry/general_line.h"

namespace slcmap {

// The axis is at the origin. The first direction is the building's, as far as an axis leaves it:
// up, and the map's x for what is upright.
class AcrossAxis {
 public:
  explicit AcrossAxis(const PointAndDirection& axis) : point_(axis.point_world) {
    constexpr double kUpright = 0.7;
    const Eigen::Vector3d& along = axis.direction_world;
    const Eigen::Vector3d way =
        std::abs(along.z()) > kUpright ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
    first_ = (way - way.dot(along) * along).normalized();
    second_ = along.cross(first_);
  }

  Eigen::Vector2d Direction(const Eigen::Vector3d& way_world) const {
    return {first_.dot(way_world), second_.dot(way_world)};
  }
  Eigen::Vector2d Place(const Eigen::Vector3d& p_world) const {
    return Direction(p_world - point_);
  }
  Eigen::Vector3d DirectionInWorld(const Eigen::Vector2d& way) const {
    return way.x() * first_ + way.y() * second_;
  }

 private:
  Eigen::Vector3d point_, first_, second_;
};

// Of places x, the one nearest to what normal . x = offset says, by least squares. The origin where
// nothing says anything.
class NearestPlace {
 public:
  void Add(const Eigen::Vector2d& normal, double offset_m, double weight) {
    H_ += weight * normal * normal.transpose();
    g_ += weight * offset_m * normal;
  }
  Eigen::Vector2d Solve() const { return H_.ldlt().solve(g_); }

 private:
  Eigen::Matrix2d H_ = 1e-6 * Eigen::Matrix2d::Identity();
  Eigen::Vector2d g_ = Eigen::Vector2d::Zero();
};

}  // namespace slcmap
