// Cameras as calibration files write them, and which are used of a rig that has more than two.
#pragma once

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

}  // namespace slcmap::data
