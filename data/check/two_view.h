// The rotation between two images of one camera, whatever its translation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace slcmap {

// The unit rays of one feature in two images, each in the frame of its camera.
struct RayPair {
  Eigen::Vector3d first, second;
};

// A ray's distance from its epipolar plane and how it changes.
struct Epipolar {
  double residual_rad = 0;        // as if both rays were as wrong
  Eigen::Vector3d turn_jacobian;  // of a right perturbation of R_first_second
  Eigen::Vector3d direction_jacobian;
};

// e = first . (direction x R_first_second second), divided by how much it changes with an error of
// both rays (Sampson's distance); `direction` is p_first_second, of unit length.
Epipolar EpipolarOf(const RayPair& rays, const Eigen::Quaterniond& R_first_second,
                    const Eigen::Vector3d& direction);

struct TwoViewMotion {
  Eigen::Quaterniond R_first_second = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // rad^2, right perturbation
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // p_first_second, of unit length
  double noise_rad = 0;                                  // of a ray, as the residuals show it
};

// Minimises the distances of the rays from their epipolar planes (Sampson's, robustly) over
// rotation and direction of the translation. Where the camera only turned, the direction means
// nothing and the rotation is as good. `guess` is a direction to try first. Nothing where too few
// rays agree.
std::optional<TwoViewMotion> SolveTwoView(const std::vector<RayPair>& rays,
                                          const Eigen::Vector3d& guess);

}  // namespace slcmap
