// The movement of a camera that sees points whose places are known.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/rigid_transform.h"

namespace slcmap {

// A point that one stereo pair placed, and the unit ray under which the left camera saw it later.
struct PlacedRay {
  Eigen::Vector3d p_first = Eigen::Vector3d::Zero();  // metres, in the left camera at first
  Eigen::Vector3d second = Eigen::Vector3d::UnitZ();  // in the left camera later
};

struct PlacedMotion {
  RigidTransform T_first_second;
  Eigen::Matrix3d rotation_covariance = Eigen::Matrix3d::Zero();     // rad^2, right perturbation
  Eigen::Matrix3d translation_covariance = Eigen::Matrix3d::Zero();  // m^2
  double noise_rad = 0;  // of a ray, as the residuals show it
};

// Minimises the distances of the points from their rays, robustly (Gauss-Newton from `guess`, with
// Cauchy weights whose scale is the median's); with a fixed rotation, over the translation alone.
// Nothing where too few agree.
std::optional<PlacedMotion> SolvePlaced(const std::vector<PlacedRay>& rays,
                                        const RigidTransform& guess, bool fixed_rotation = false);

}  // namespace slcmap
