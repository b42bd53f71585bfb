// The form in which others write poses: of what, in which order, unit and world.
#pragma once

#include <optional>
#include <string>

#include "data/rigid_transform.h"

namespace slcmap {

// What is done to the rows of a file so that they are poses of the IMU in metres, in a world with z
// up, at times of the images' clock. "" is for what the file tells.
struct PoseForm {
  // What a row is the pose of: "imu" or "camera" (the left one) in the world, or the world's in
  // either, as "world-in-camera".
  std::string of = "imu";
  // "xyzw", "wxyz", or these with "-conjugated" behind: its rotation is the inverse one.
  std::string quaternion;
  std::string up = "z";  // where up is in the world of the poses: an axis, or "x,y,z"
  double scale = 1;      // metres a unit of the file
  std::string stamps;    // "ns", "us", "ms", "s", or a file with a stamp in each row
  double offset_s = 0;   // added to the stamps

  void Check() const;  // throws ConfigError naming the option
  bool IsInverse() const { return of.starts_with("world-in-"); }
  bool IsOfCamera() const { return of.ends_with("camera"); }
  bool IsConjugated() const { return quaternion.ends_with("-conjugated"); }
  Eigen::Vector3d Up() const;  // of unit length; throws ConfigError
};

// The options that say what another form says in another way, as they are typed; "" where none do.
std::string OptionsOf(const PoseForm& form);

// The direction as --up takes it: an axis where it is within a degree and a half of one.
std::string UpInWords(const Eigen::Vector3d& up);

}  // namespace slcmap
