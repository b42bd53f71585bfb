#include "odometry/structure/interpretation_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

// What detectors and lenses leave uncorrected, however long the segment is.
constexpr double kSystematicSigma_rad = 0.001;

}  // namespace

InterpretationPlane InterpretationPlane::Rotated(const Eigen::Matrix3d& R_other_this) const {
  InterpretationPlane out = *this;
  out.middle = R_other_this * middle;
  out.along = R_other_this * along;
  out.normal = R_other_this * normal;
  return out;
}

InterpretationPlane PlaneOfSegment(const LineSegment& segment, double end_sigma) {
  const Eigen::Vector3d start = segment.start.homogeneous().normalized();
  const Eigen::Vector3d end = segment.end.homogeneous().normalized();
  InterpretationPlane plane;
  plane.middle = (start + end).normalized();
  plane.along = (end - start).normalized();
  plane.normal = plane.middle.cross(plane.along);
  plane.length_rad = std::atan2(start.cross(end).norm(), start.dot(end));
  // Seen from the camera, a length on the plane z = 1 shrinks by at most cos^2 of the angle to the
  // optical axis, along the radius; an end's error shrinks with the segment.
  const double shrink = plane.length_rad / std::max(segment.Length(), 1e-12);
  const double ends_rad = std::sqrt(2.0) * end_sigma * shrink / std::max(plane.length_rad, 1e-12);
  plane.sigma_rad = std::hypot(ends_rad, kSystematicSigma_rad);
  return plane;
}

VanishingAngle AngleToVanishingPoint(const InterpretationPlane& plane,
                                     const Eigen::Vector3d& direction, double direction_sigma_rad) {
  const double across = direction.dot(plane.normal);
  const double along = direction.dot(plane.along);
  // Seen from the segment, the vanishing point is so far away; an error of the direction turns the
  // ray to it by the error over this distance.
  const double distance = std::max(std::hypot(across, along), 1e-9);
  return {std::atan2(std::abs(across), std::abs(along)),
          std::hypot(plane.sigma_rad, direction_sigma_rad / distance)};
}

}  // namespace slcmap
