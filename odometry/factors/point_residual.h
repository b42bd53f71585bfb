// The reprojection terms of an inverse-depth point.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "odometry/factors/factor.h"
#include "odometry/geometry/exposure.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline odometry {

// Of what one camera measured of a point (2 rows), that is kept.
inline constexpr double kMaxPointChi2 = 12;

// What all point residuals of a rig share, by camera.
struct StereoGeometry {
  std::vector<RigidTransform> T_imu_camera;
  std::vector<Eigen::Matrix3d> R_imu_camera;
  double weight = 1;  // focal length over the standard deviation of a measurement, both in pixels
  std::vector<LensCorrection> lenses;
  std::shared_ptr<const std::vector<LensShift>> lens_shifts;  // null for ideal pinholes

  StereoGeometry() = default;
  StereoGeometry(const std::vector<RigidTransform>& T_imu_camera, double weight);

  // The same with what a camera calibration block (see blocks.h) says.
  StereoGeometry CorrectedBy(const double* cameras) const;

  // How measurements move with what the lenses are.
  const LensShift& GetShift(int camera) const {
    static const LensShift kIdeal;
    return lens_shifts ? (*lens_shifts)[camera] : kIdeal;
  }
  // Where on the plane z = 1 what was measured is by the lens as it is.
  Eigen::Vector2d OnTruePlane(int camera, const Eigen::Vector2d& measured) const {
    const double s = lenses[camera].focal_length;
    const LensShift& shift = GetShift(camera);
    return measured - s / (1 + s) * shift.ByFocalLength(measured) -
           shift.ByCentre(measured) * lenses[camera].centre_px;
  }
};

// A point on the plane z = 1 of a rectified camera, in the left and (where seen) the right one of a
// pair.
struct StereoMeasurement {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
  int camera = 0;  // whose `left` is; `right` is of the next one
  // As it was measured, a place a camera, where what is above was brought to the stamp.
  std::vector<TimedPlace> timed = {};

  // Where it was at the stamp if the readout is longer.
  StereoMeasurement WithReadoutLonger(double by_s) const {
    StereoMeasurement moved = *this;
    moved.left += by_s * timed[0].by_readout_per_s;
    if (right) *moved.right += by_s * timed[1].by_readout_per_s;
    return moved;
  }
};

// A measurement, and how it moves with a focal length s and a principal point.
struct LensMeasurement {
  LensMeasurement() = default;
  LensMeasurement(const StereoGeometry& geometry, int camera, const Eigen::Vector2d& at);

  // On the plane z = 1 by the lens, and its derivative by the focal length; that by the principal
  // point is -by_centre.
  Eigen::Vector2d At(const LensCorrection& lens) const {
    const double s = lens.focal_length;
    return measured - s / (1 + s) * shift - by_centre * lens.centre_px;
  }
  Eigen::Vector2d ByFocalLength(double s) const { return -shift / ((1 + s) * (1 + s)); }
  // Brings a difference there back to the plane of the measurement, where noise is what it is: a
  // longer focal length must not gain by residuals that it makes smaller.
  Eigen::Matrix2d Magnification(double s) const {
    return Eigen::Matrix2d::Identity() + s * gradient;
  }

  Eigen::Vector2d measured = Eigen::Vector2d::Zero(), shift = Eigen::Vector2d::Zero();
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Identity();  // of the shift
  Eigen::Matrix2d by_centre = Eigen::Matrix2d::Zero();
};

// A point block is (x, y, lambda): where it lies on the plane z = 1 of its host's camera h (the
// left one of its pair) as it was given, and its inverse depth there (1 / m). The
// bearing is estimated beside the depth: taken as measured, the host's noise would enter all
// observations of the point as one error that nobody accounts for.
//
// Blocks: pose of the host, pose of the target, camera calibration (psi, s, d), point. With z = (x,
// y, 1), in camera c of the target, scaled by the inverse depth (so that a point at infinity is
// nothing special):
//
//   m   = R_t^T ( R_h (R_ICh z + lambda p_ICh) + lambda (p_h - p_t) )
//   p_c = Exp(-psi)^e R_ICc^T ( m - lambda p_ICc )
//   r   = weight (1 + s G_c) ( p_c.xy / p_c.z - (measured - s / (1 + s) g_c(measured)
//                                                - e H_c(measured) d) )
//
// where G_c is the gradient of g_c there, and e is 1 for the rig's second camera, else 0.
//
// Rows: two for the left camera, and two more when the target saw the point in the right one.
class PointResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  PointResidual(const StereoGeometry* geometry, const StereoMeasurement& target,
                int host_camera = 0);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  std::array<LensMeasurement, 2> target_;
  int host_camera_, first_camera_, cameras_;
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
  std::array<LensMeasurement, 2> host_;
  int first_camera_, cameras_;
};

}  // namespace slcmap::odometry
