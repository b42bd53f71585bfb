// Right images that are rectified with what was found of the right camera, while all measurements
// are told as the given calibration has them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "odometry/geometry/lens_shift.h"

namespace slcmap {

// What was found of the right camera: turned by Exp(rotation_rad) in its rectified frame, with its
// principal point off by centre_px of the image as it was recorded.
struct RightCorrection {
  Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
};

class RightRectification {
 public:
  RightRectification() = default;
  // `rectified` is the right rectified camera, and `lens` how places in it move with the given one.
  RightRectification(const Camera& rectified, const LensShift& lens)
      : camera_(rectified), lens_(lens) {}

  // From now on pixels are of images that were rectified so.
  void Set(const RightCorrection& correction) { correction_ = correction; }

  // A pixel on the plane z = 1 of the right rectified camera as it was given.
  Eigen::Vector2d GivenPlane(const Eigen::Vector2d& px) const;

  // How far the rows of images are off, were the right camera as `is`: at their middle or corners,
  // where that is most.
  double RowsOff_px(const RightCorrection& is) const;

 private:
  Camera camera_;
  LensShift lens_;
  RightCorrection correction_;
};

}  // namespace slcmap
