// The reprojection terms of an inverse-depth point.
#pragma once

#include <array>
#include <optional>

#include "odometry/residuals/factor.h"

namespace slcmap {

// What all point residuals of a rig share.
struct StereoGeometry {
  std::array<RigidTransform, 2> T_imu_camera;
  std::array<Eigen::Matrix3d, 2> R_imu_camera;
  double weight = 1;  // focal length over the standard deviation of a measurement, both in pixels
  double focal_scale = 1;  // of the true focal length to that of the plane z = 1

  StereoGeometry() = default;
  StereoGeometry(const std::array<RigidTransform, 2>& T_imu_camera, double weight);

  // The same with what a camera calibration block (see calibration.h) says.
  StereoGeometry CorrectedBy(const double* cameras) const;

  // The ray of a measurement, of any length.
  Eigen::Vector3d Ray(const Eigen::Vector2d& measured) const {
    return {measured.x(), measured.y(), focal_scale};
  }
};

// A point on the plane z = 1 of a rectified camera, in the left and (where seen) the right one.
struct StereoMeasurement {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
};

// A point block is (x, y, lambda): where it lies on the plane z = 1 of its host's left camera, and
// its inverse depth there (1 / m). The bearing is estimated beside the depth: taken as measured,
// the host's noise would enter all observations of the point as one error that nobody accounts for.
//
// Blocks: pose of the host, pose of the target, camera calibration (psi, s), point. With z = (x, y,
// 1), in camera c of the target, scaled by the inverse depth (so that a point at infinity is
// nothing special):
//
//   m   = R_t^T ( R_h (R_IC z + lambda p_IC) + lambda (p_h - p_t) )
//   p_c = Exp(-psi)^c R_ICc^T ( m - lambda p_ICc )
//   r   = weight ( (1 + s) p_c.xy / p_c.z - measured )
//
// Rows: two for the left camera, and two more when the target saw the point in the right one.
class PointResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  PointResidual(const StereoGeometry* geometry, const StereoMeasurement& target);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  StereoMeasurement target_;
};

// Blocks: camera calibration, point. What the host itself measured of it: two rows for the left
// camera, and two more when it saw the point in the right one.
class HostPointResidual final : public Factor {
 public:
  HostPointResidual(const StereoGeometry& geometry, const StereoMeasurement& host);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
  RigidTransform T_right_left_;
  StereoMeasurement host_;
};

}  // namespace slcmap
