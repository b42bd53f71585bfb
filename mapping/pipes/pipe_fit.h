// The cylinder that the outlines of a pipe in images are tangent to, and places as seen along an
// axis.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "mapping/pipes/options.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {

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

// The cylinder that the outlines of a pipe in images are tangent to.
//
// The outlines of a pipe are no lines of the world: they move over it with the view. But a ray from
// a camera through one of them touches the pipe: its distance from the axis is the radius.

struct Cylinder {
  PointAndDirection axis;
  double radius_m = 0;
};

struct TangentRay {
  Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();  // of the camera
  Eigen::Vector3d ray_world = Eigen::Vector3d::UnitZ();    // unit
  double sigma_m = 0;                                      // across the ray, at the pipe
  int image = 0;                                           // rays of one image share their errors
};

// The distance of the ray from the axis, positive where it passes on one side, negative on the
// other.
double SignedDistance(const PointAndDirection& axis, const TangentRay& ray);

// How far, outwards, a ray is from touching the cylinder (m).
double OffTangent(const Cylinder& cylinder, const TangentRay& ray);

struct PipeFit {
  Cylinder cylinder;  // the point of the axis is that of the start, moved across it
  // Of the axis across it at its point (m, first two), of its direction (rad), along the columns of
  // `across`, and of the radius (m).
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 3, 2> across = Eigen::Matrix<double, 3, 2>::Zero();
  int images = 0;

  double sigma_m() const;  // of the axis across it at its point, where that is largest
  double radius_sigma_m() const;
};

// Gauss-Newton from `start`, whose axis tells on which side of it each ray passes. Nothing where
// the rays do not determine a cylinder.
std::optional<PipeFit> FitPipe(const Cylinder& start, const std::vector<TangentRay>& rays,
                               const PipeFitOptions& options);

}  // namespace slcmap::mapping
