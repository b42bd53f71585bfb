// The cylinder that the outlines of a pipe in images are tangent to, places as seen along an axis,
// and the options of the pipe stage.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "data/io/yaml.h"
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

struct PipeFitOptions {
  double robust_sigmas = 2;     // at which a ray counts half (Cauchy)
  int images_that_count = 10;   // more images of one pipe share their errors
  double direction_rad = 0.05;  // from the start: weakly held there
};

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

// The options of the pipe stage.

struct PipeOptions {
  bool find = true;
  double min_radius_m = 0.015, max_radius_m = 0.32;
  // The outlines of a square bar are up to a sixth of the radius off those of a pipe: of thinner
  // ones that is less than twice what rays are off at 2 m. Only how wide images show them tells
  // these.
  double min_outlined_radius_m = 0.035;
  double min_length_m = 0.75;
  double sigma_px = 0.4;        // of where an image has an outline
  double pose_sigma_m = 0.002;  // of the views against each other
  double max_turn_rad = 0.05;   // between lines that are outlines of one pipe
  double max_off_sigmas = 3;    // of a ray that touches the pipe
  double min_touching = 0.75;   // share of the rays to an outline
  // Share of the images that show outlines on both sides; less is enough where the cloud is round.
  double min_both_sides = 0.4;
  // Of the misfit of the cylinder: that of fixed edges in its place is at least so much more.
  double min_gain = 1.3;
  // Of the median distance of points of the cloud from a pipe that they alone tell, in radii; and
  // of one that its outlines tell.
  double max_surface_off = 0.12, max_outlined_off_m = 0.05;
  PipeFitOptions fit;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
