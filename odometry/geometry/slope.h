// Directions that are neither vertical nor level: of handrails, ramps, rafters.
#pragma once

#include <Eigen/Core>
#include <array>

#include "odometry/geometry/structural_line.h"

namespace slcmap {

// A slope block is (azimuth, elevation) in rad: the direction rises by the elevation, in (0, pi/2),
// towards the azimuth from the world's x. Near the vertical the azimuth would mean nothing, and
// nothing so steep is a slope.
inline constexpr int kSlopeSize = 2;
using SlopeBlock = std::array<double, kSlopeSize>;

// The block of a direction, of whatever length and sign; it must not be vertical.
SlopeBlock SlopeOf(const Eigen::Vector3d& direction);

// The unit direction, and two axes across it: the level one, and the one that is upright over it.
Eigen::Vector3d SlopeDirection(const double* slope);
Matrix32d AxesAcrossSlope(const double* slope);

}  // namespace slcmap
