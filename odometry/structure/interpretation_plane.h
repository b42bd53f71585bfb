// The plane through the camera's centre and a segment, and how well a direction fits it.
#pragma once

#include <Eigen/Core>

#include "data/types.h"

namespace slcmap {

// All lines in space that project onto the segment lie in this plane. Of the three axes (unit, at
// right angles, all in the frame that the plane was made in) `middle` points to the segment's
// middle, `along` along the segment, and `normal` = middle x along. The plane is known up to a turn
// about `middle`.
struct InterpretationPlane {
  Eigen::Vector3d middle = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  double length_rad = 0;  // that the segment is seen under
  double sigma_rad = 0;   // of the turn about `middle`

  // The same plane in another frame.
  InterpretationPlane Rotated(const Eigen::Matrix3d& R_other_this) const;
};

// segment: on the plane z = 1 of a camera; the plane is in that camera's frame. end_sigma: standard
// deviation of an end across the segment, on z = 1 (pixels over focal length).
InterpretationPlane PlaneOfSegment(const LineSegment& segment, double end_sigma);

// The angle at the segment between it and the ray from its middle to the vanishing point of a
// direction (SLC-VIO, section 3.4; here on the sphere, where it does not depend on the place in the
// image), in [0, pi/2], and its standard deviation, when the direction (unit, in the plane's frame)
// is known to direction_sigma_rad about both axes. It is large near the vanishing point, where the
// angle means nothing.
struct VanishingAngle {
  double angle_rad = 0;
  double sigma_rad = 0;
};
VanishingAngle AngleToVanishingPoint(const InterpretationPlane& plane,
                                     const Eigen::Vector3d& direction, double direction_sigma_rad);

}  // namespace slcmap
