// How a rig's cameras lie to each other, and how a camera moved: between two images, whatever its
// translation, or by points whose places are known.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "data/core/rigid_transform.h"
#include "data/core/types.h"

namespace slcmap::inline data {

inline constexpr double kAgree_px = 2.5;    // of rays that agree, across the epipolar line
inline constexpr double kUsualDepth_m = 4;  // from where a search in the right image starts

// The figure that says how well left and right images agree, in %.
inline constexpr const char* kAgreeingMatches = "matches that agree with calibration";

// From the right camera to the left one.
inline RigidTransform LeftRight(const Rig& rig) {
  return rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
}

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
Epipolar ComputeEpipolar(const RayPair& rays, const Eigen::Quaterniond& R_first_second,
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

// Right images as the left camera would show them in size, for following features between both.

// Cameras of one size and about one focal length are left as they are. Others' right images are
// scaled to the left focal length, and both filled up on the right and below to one size.
class LikeLeft {
 public:
  explicit LikeLeft(const Rig& rig);

  cv::Mat Left(const cv::Mat& left) const;
  cv::Mat Right(const cv::Mat& right) const;

  // Between pixels of the right camera and those of Right().
  cv::Point2f FromRight(const cv::Point2f& px) const;
  cv::Point2f ToRight(const cv::Point2f& px) const;

 private:
  float scale_ = 1;
  cv::Size scaled_, filled_;  // of right images, and of both
};

}  // namespace slcmap::data
