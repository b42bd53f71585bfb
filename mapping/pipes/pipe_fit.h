// The cylinder that the outlines of a pipe in images are tangent to.
//
// The outlines of a pipe are no lines of the world: they move over it with the view. But a ray from
// a camera through one of them touches the pipe: its distance from the axis is the radius.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "odometry/geometry/general_line.h"

namespace slcmap {

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

}  // namespace slcmap
