// Lines along an axis of a Manhattan world, of any direction, and along slopes; and what the
// estimator expects to see of the lines that it knows.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "data/core/types.h"

namespace slcmap::inline odometry {

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

// A general line block is (q as x y z w, phi in rad), the orthonormal representation of Pluecker
// coordinates (Bartoli and Sturm, CVIU 2005). With U = R(q) = (u1, u2, u3) and an anchor, a
// constant point of the world:
//
//   moment about the anchor = cos(phi) u1          direction = sin(phi) u2
//
// so that the line passes the anchor at the distance |cot(phi)| in metres. An anchor at zero is the
// form of PL-VIO; anchored where it was first seen from, a line is well conditioned anywhere. The
// tangent is (dtheta, dphi): U <- U Exp(dtheta), phi <- phi + dphi.
inline constexpr int kGeneralLineSize = 5;
inline constexpr int kGeneralLineTangentSize = 4;
using GeneralLineBlock = std::array<double, kGeneralLineSize>;

// A line of the world: the point nearest to the anchor, and the unit direction.
struct PointAndDirection {
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitX();
};

// The point of a line, whose direction has unit length, that is nearest to a point.
Eigen::Vector3d NearestOn(const PointAndDirection& line, const Eigen::Vector3d& p_world);

// The line through a point; the direction need not have unit length. The line must not pass through
// the anchor.
GeneralLineBlock GeneralLineThrough(const Eigen::Vector3d& anchor_world,
                                    const Eigen::Vector3d& p_world,
                                    const Eigen::Vector3d& direction_world);

PointAndDirection GeneralLineFromBlock(const Eigen::Vector3d& anchor_world, const double* block);

// Derivatives by the block's tangent: of the unit direction, and of the point that lies along_m
// from the one nearest to the anchor.
Eigen::Matrix<double, 3, 4> GeneralLineTurn(const double* block);
Eigen::Matrix<double, 3, 4> GeneralLineShift(const double* block, double along_m);

// Directions that are neither vertical nor level: of handrails, ramps, rafters.

// A slope block is (azimuth, elevation) in rad: the direction rises by the elevation, in (0, pi/2),
// towards the azimuth from the world's x. Near the vertical the azimuth would mean nothing, and
// nothing so steep is a slope.
inline constexpr int kSlopeSize = 2;
using SlopeBlock = std::array<double, kSlopeSize>;

// The block of a direction, of whatever length and sign; it must not be vertical.
SlopeBlock MakeSlope(const Eigen::Vector3d& direction);

// The unit direction, and two axes across it: the level one, and the one that is upright over it.
Eigen::Vector3d SlopeDirection(const double* slope);
Matrix32d AxesAcrossSlope(const double* slope);

// Where a line that the estimator knows in 3D is expected in the next pair, in pixels of the
// rectified cameras, clipped to the image.
struct LinePrediction {
  int64_t id = 0;
  LineSegment left_px;
  std::optional<LineSegment> right_px;
  double sigma_px = 1;  // of its place across the line
  int camera = 0;       // whose left_px it is, of two that look apart
};

}  // namespace slcmap::odometry
