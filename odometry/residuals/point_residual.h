// The reprojection terms of an inverse-depth point.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "odometry/geometry/focal_shift.h"
#include "odometry/residuals/factor.h"

namespace slcmap {

// What all point residuals of a rig share.
struct StereoGeometry {
  std::array<RigidTransform, 2> T_imu_camera;
  std::array<Eigen::Matrix3d, 2> R_imu_camera;
  double weight = 1;  // focal length over the standard deviation of a measurement, both in pixels
  double focal_length = 0;  // by this share longer than given
  // Of the left and the right camera; null for ideal pinholes.
  std::shared_ptr<const std::array<FocalShift, 2>> focal_shifts;

  StereoGeometry() = default;
  StereoGeometry(const std::array<RigidTransform, 2>& T_imu_camera, double weight);

  // The same with what a camera calibration block (see calibration.h) says.
  StereoGeometry CorrectedBy(const double* cameras) const;

  // How measurements move with the focal lengths.
  const FocalShift& ShiftOf(int camera) const {
    static const FocalShift kIdeal;
    return focal_shifts ? (*focal_shifts)[camera] : kIdeal;
  }
  // Where on the plane z = 1 what was measured is by the focal length.
  Eigen::Vector2d OnTruePlane(int camera, const Eigen::Vector2d& measured) const {
    return measured - focal_length / (1 + focal_length) * ShiftOf(camera).At(measured);
  }
};

// A point on the plane z = 1 of a rectified camera, in the left and (where seen) the right one.
struct StereoMeasurement {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
};

// A measurement, and how it moves with a focal length s.
struct FocalMeasurement {
  FocalMeasurement() = default;
  FocalMeasurement(const StereoGeometry& geometry, int camera, const Eigen::Vector2d& at);

  // On the plane z = 1 by the focal length, and its derivative.
  Eigen::Vector2d At(double s) const { return measured - s / (1 + s) * shift; }
  Eigen::Vector2d ByFocalLength(double s) const { return -shift / ((1 + s) * (1 + s)); }
  // Brings a difference there back to the plane of the measurement, where noise is what it is: a
  // longer focal length must not gain by residuals that it makes smaller.
  Eigen::Matrix2d Magnification(double s) const {
    return Eigen::Matrix2d::Identity() + s * gradient;
  }

  Eigen::Vector2d measured = Eigen::Vector2d::Zero(), shift = Eigen::Vector2d::Zero();
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Identity();  // of the shift
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
//   r   = weight (1 + s G_c) ( p_c.xy / p_c.z - (measured - s / (1 + s) g_c(measured)) )
//
// where G_c is the gradient of g_c there.
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
  std::array<FocalMeasurement, 2> target_;
  int cameras_;
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
  std::array<FocalMeasurement, 2> host_;
  int cameras_;
};

}  // namespace slcmap
