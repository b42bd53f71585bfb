// Cameras as calibration files write them, and which are used of a rig that has more than two.
// And what ROS says of a camera (sensor_msgs/CameraInfo), in a message or a file of
// camera_calibration.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "data/core/camera.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline data {

// A camera's numbers under the names that Kalibr gives them: intrinsics are fx, fy, cx, cy in
// pixels, behind the numbers of the lens (xi of omni, alpha and beta of eucm, xi and alpha of ds).
struct CameraWords {
  std::string camera_model;      // pinhole, omni, eucm, ds
  std::string distortion_model;  // radtan, equidistant, fov, none
  std::vector<double> intrinsics, coefficients;
};

// The name that slcmap's own files have for it, and what has that name, or another that is known;
// nothing where none has.
const char* GetName(Distortion distortion);
std::optional<Distortion> FindDistortion(const std::string& name);

CameraWords DescribeCamera(const Camera& camera);

// The camera of such words, without its size; also of the names that ASL (radial-tangential), ROS
// (plumb_bob, rational_polynomial, fisheye) and Basalt (kb4, pinhole-radtan8, ucm; lens's numbers
// and coefficients behind fx, fy, cx, cy) have for the same. Where they are not a camera, *fault
// says which of the four is wrong, and what is expected of it.
struct CameraFault {
  std::string key;  // camera_model, distortion_model, intrinsics or coefficients
  std::string found, expected;
};
std::optional<Camera> GetCamera(const CameraWords& words, CameraFault* fault);

// A camera of a chain as its calibration tells it.
struct ChainCamera {
  int index = 0;  // in "cam0", "cam1", ...
  Camera camera;
  RigidTransform T_imu_camera;
  std::optional<double> time_shift_s;  // stamp on the IMU's clock = camera stamp + this
  std::string place;                   // for messages
  std::string source = {};             // which transforms its pose is from
  double readout_s = 0;                // see Rig
};

// Positions in the chain of the cameras that are used: those of the `wanted` indices; else all, as
// Rig has them: the two of which the first sees most of what the second one sees, from places that
// are apart, then the next such pair, and last those that look another way. One that looks
// as the lone one before it, and is of no use beside it, is left out. Throws InputFault for wanted
// cameras that the chain has not.
std::vector<size_t> ChooseCameras(const std::vector<ChainCamera>& chain,
                                  const std::vector<int>& wanted);

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
