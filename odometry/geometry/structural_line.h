// Lines along an axis of a Manhattan world, with two degrees of freedom.
#pragma once

#include <Eigen/Core>
#include <array>

#include "data/types.h"

namespace slcmap {

// A heading block is the angle psi (rad) by which the X axis of a Manhattan world M is turned from
// the world's x: R_world_manhattan = Rz(psi). The paper estimates a free rotation; here M shares
// the vertical with gravity, as buildings do, so that one angle is left.
inline constexpr int kHeadingSize = 1;

// A structural line block is (theta in rad, rho in 1 / m): where the line crosses the plane through
// its anchor that is normal to its axis, in polar coordinates with inverse distance.
inline constexpr int kStructuralLineSize = 2;
using StructuralLineBlock = std::array<double, kStructuralLineSize>;

// What is known of a structural line for good. With E the two axes of M other than the line's own
// (X: y, z; Y: x, z; vertical: x, y), as columns in the world:
//
//   (a, b) = (cos theta, sin theta) / rho          P = anchor + E (a, b)
//
// Anchored where the camera was that first saw it, a line is well conditioned wherever it is; an
// anchor at zero is the form of SLC-VIO, section 3.1. The anchor is fixed in the world, not in M:
// a change of heading then turns the line about a point nearby, not about the world's origin.
struct StructuralLine {
  LineAxis axis = LineAxis::kVertical;  // not kNone
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();

  // A vertical line is the same in every Manhattan world: it has no heading block, and its crossing
  // point is told along the world's x and y.
  bool HasHeading() const { return axis != LineAxis::kVertical; }
};

using Matrix32d = Eigen::Matrix<double, 3, 2>;

// The direction of an axis in the world, and the two axes across it. The heading is of no concern
// to the vertical.
Eigen::Vector3d AxisDirection(LineAxis axis, double heading_rad);
Matrix32d AxesAcross(LineAxis axis, double heading_rad);

// Where the line crosses the plane through its anchor, in the world.
Eigen::Vector3d CrossingPoint(const StructuralLine& line, double heading_rad, const double* block);

// The block of the line through a point of the world. The point must not lie on the axis through
// the anchor.
StructuralLineBlock StructuralLineThrough(const StructuralLine& line, double heading_rad,
                                          const Eigen::Vector3d& p_world);

}  // namespace slcmap
