// Lines of any direction, with four degrees of freedom.
#pragma once

#include <Eigen/Core>
#include <array>

namespace slcmap {

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

}  // namespace slcmap
