// What ROS says of a camera (sensor_msgs/CameraInfo), in a message or a file of camera_calibration.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "data/core/camera.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline data {

// The names are ROS': K and D are the lens's, R turns its rays to those of the rectified image, of
// which P is the projection.
struct CameraInfo {
  int width_px = 0, height_px = 0;
  std::string distortion_model;
  std::vector<double> d;
  Eigen::Matrix3d k = Eigen::Matrix3d::Zero(), r = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 4> p = Eigen::Matrix<double, 3, 4>::Zero();
  std::string place;  // for messages
};

enum class ImageKind { kRaw, kRectified };

// As nothing is distorted and both projections are the same, images are the rectified ones.
bool IsUndistorted(const CameraInfo& info);

// The camera of such images. Throws InputFault, also for a driver that had no calibration (zeros).
Camera CameraFromInfo(const CameraInfo& info, ImageKind kind);

// T_left_right of such images by P, and of raw ones by R, where these rectify: rotations, not
// both identities, while both P have one focal length. Drivers write the baseline at the right
// camera (negative) or at the left one (positive); it comes out along the left camera's x axis,
// against it where the cameras are the other way about. Nothing where the two do not tell it.
std::optional<RigidTransform> RightPoseFromInfo(const CameraInfo& left, const CameraInfo& right,
                                                ImageKind kind);

}  // namespace slcmap::data
