// The reprojection terms of lines along an axis and of any direction, and what they share: how far
// the ends of an observed segment are from a line's image.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "data/core/types.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/point_residual.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline odometry {

// A segment on the plane z = 1 of a rectified camera, in the left and (where seen) the right one.
struct StereoLineMeasurement {
  LineSegment left;
  std::optional<LineSegment> right;
  int camera = 0;     // whose `left` is: see LineObservation
  double weight = 1;  // times that of the geometry: how much better than others it was measured
  // As it was measured, start and end a camera, where what is above was brought to the stamp.
  std::vector<TimedPlace> timed = {};

  int rows() const { return right ? 4 : 2; }

  // Where its ends were at the stamp if the readout is longer.
  StereoLineMeasurement WithReadoutLonger(double by_s) const {
    StereoLineMeasurement moved = *this;
    const auto move = [&](size_t first, LineSegment* segment) {
      segment->start += by_s * timed[first].by_readout_per_s;
      segment->end += by_s * timed[first + 1].by_readout_per_s;
    };
    move(0, &moved.left);
    if (right) move(2, &*moved.right);
    return moved;
  }
};

// A line of the world in Pluecker coordinates about an anchor, up to scale: for a point p of it,
// moment = (p - anchor) x direction.
struct PlueckerLine {
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
};

// Derivatives of a Pluecker line by up to four parameters, a column each.
struct PlueckerJacobian {
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 4>;
  Columns moment, direction;
};

// A line's residuals by the pose (dp, dtheta), by the camera calibration (psi, s, d) and by the
// parameters of its Pluecker Jacobian.
struct LineReprojectionJacobian {
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, 4, 6> by_pose;
  Eigen::Matrix<double, Eigen::Dynamic, kCameraCalibrationSize, Eigen::RowMajor, 4,
                kCameraCalibrationSize>
      by_cameras;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 4, 4> by_line;
};

// With the centre c and rotation R of a camera in the world, the line's image is the homogeneous
//
//   n = diag(1, 1, 1 + s) R^T ( moment + (anchor - c) x direction )
//
// and each end s = (x, y, 1) of the segment gives r = weight (s . n) / |(n_1, n_2)|, its signed
// distance (SLC-VIO, section 3.3, without the division by depth). Rows: the two ends in the left
// camera, then (where seen) in the right one. Where the line has no image (it passes through the
// camera, or its plane is parallel to the image), the rows are constant. `cameras` is a camera
// calibration block (see blocks.h), which turns the right camera by psi; null where the
// geometry is exact.
void EvaluateLineReprojection(const StereoGeometry& geometry,
                              const StereoLineMeasurement& measurement, const double* pose,
                              const double* cameras, const PlueckerLine& line, double* residuals);

// The same with derivatives.
void LinearizeLineReprojection(const StereoGeometry& geometry,
                               const StereoLineMeasurement& measurement, const double* pose,
                               const double* cameras, const PlueckerLine& line,
                               const PlueckerJacobian& line_jacobian, double* residuals,
                               LineReprojectionJacobian* jacobian);

// Blocks: pose, camera calibration (where it is bound), heading (but for a vertical line),
// structural line. Rows as in EvaluateLineReprojection().
class StructuralLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  StructuralLineResidual(const StereoGeometry* geometry, const StructuralLine& line,
                         const StereoLineMeasurement& measurement, bool binds_cameras = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  StructuralLine line_;
  StereoLineMeasurement measurement_;
  bool binds_cameras_;
};

// Blocks: pose, camera calibration (where it is bound), general line. Rows as in
// EvaluateLineReprojection().
class GeneralLineResidual final : public Factor {
 public:
  // The geometry must outlive the residual.
  GeneralLineResidual(const StereoGeometry* geometry, const Eigen::Vector3d& anchor_world,
                      const StereoLineMeasurement& measurement, bool binds_cameras = false);

 protected:
  void EvaluateAt(const double* const* parameters, double* residuals,
                  double** jacobians) const override;

 private:
  const StereoGeometry* geometry_;
  Eigen::Vector3d anchor_world_;
  StereoLineMeasurement measurement_;
};

}  // namespace slcmap::odometry
