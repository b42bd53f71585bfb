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

  StereoGeometry() = default;
  StereoGeometry(const std::array<RigidTransform, 2>& T_imu_camera, double weight);
};

// A point on the plane z = 1 of a rectified camera, in the left and (where seen) the right one.
struct StereoMeasurement {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
};

// Blocks: pose of the host, pose of the target, inverse depth in the host's left camera (1 / m).
// With z the host's measurement, in camera c of the target, scaled by the inverse depth (so that a
// point at infinity is nothing special):
//
//   m   = R_t^T ( R_h (R_IC z + lambda p_IC) + lambda (p_h - p_t) )
//   p_c = R_ICc^T ( m - lambda p_ICc )          r = weight ( p_c.xy / p_c.z - measured )
//
// Rows: two for the left camera, and two more when the target saw the point in the right one.
class PointResidual final : public Factor {
 public:
  PointResidual(const StereoGeometry* geometry, const Eigen::Vector2d& host_left,
                const StereoMeasurement& target);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  Eigen::Vector3d host_ray_imu_;  // R_IC z
  StereoMeasurement target_;
};

// Block: inverse depth. The host's own measurement in its right camera, two rows.
class HostStereoResidual final : public Factor {
 public:
  HostStereoResidual(const StereoGeometry* geometry, const Eigen::Vector2d& host_left,
                     const Eigen::Vector2d& host_right);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  double weight_;
  Eigen::Vector3d ray_right_, baseline_right_;  // p_right = ray + lambda baseline
  Eigen::Vector2d measured_;
};

}  // namespace slcmap
