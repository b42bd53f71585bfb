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

// With the centre c and rotation R of a camera in the world, the line's image is the homogeneous
//
//   n = diag(1, 1, 1 + s) R^T ( moment + (anchor - c) x direction )
//
// and each end s = (x, y, 1) of the segment gives r = weight (s . n) / |(n_1, n_2)|, its signed
// distance (SLC-VIO, section 3.3, without the division by depth). Rows: the two ends in the left
// camera, then (where seen) in the right one. Where the line has no image (it passes through the
// camera, or its plane is parallel to the image), the rows are constant. `cameras` is a camera
// calibration block (see factor.h), which turns the right camera by psi; null where the
// geometry is exact.

// Blocks: pose, camera calibration (where it is bound), heading (but for a vertical line),
// structural line.
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

// Blocks: pose, camera calibration (where it is bound), general line.
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
