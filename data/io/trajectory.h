// Trajectories of the IMU body: TUM and EuRoC files in, TUM files out; and the form in which others
// write poses: of what, in which order, unit and world.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/core/rigid_transform.h"
#include "data/core/types.h"

namespace slcmap::inline data {

struct StampedPose {
  int64_t stamp_ns = 0;
  RigidTransform T_world_imu;
};

using Trajectory = std::vector<StampedPose>;  // sorted by stamp, no stamp twice

// Reads poses of the IMU as slcmap or others write them (ReadPoseTable in data/io/pose_file.h), as
// they are.
Trajectory ReadTrajectory(const std::string& path);

// One TUM row with its end of line, and the comment that opens a file of them.
std::string TumRow(const StampedPose& pose);
inline constexpr const char* kTumHeader = "# stamp_s x_m y_m z_m qx qy qz qw\n";

// Writes the header and TUM rows with stamps of nine decimals. Throws OutputError when the file
// can't be written.
void WriteTumTrajectory(const std::string& path, const Trajectory& trajectory);

// The pose at a stamp, interpolated between its neighbours; nothing outside the trajectory, or
// where the neighbours are more than max_gap_s apart.
std::optional<RigidTransform> PoseAt(const Trajectory& trajectory, int64_t stamp_ns,
                                     double max_gap_s = 0.5);

// The same or, where there are no such neighbours, the pose that is at most max_offset_s away: that
// of the stamp, which was rounded.
std::optional<RigidTransform> PoseNear(const Trajectory& trajectory, int64_t stamp_ns,
                                       double max_gap_s, double max_offset_s);

// The time from a pose to the next.
double MedianPeriod_s(const Trajectory& trajectory);

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
std::string FormatOptions(const PoseForm& form);

// The direction as --up takes it: an axis where it is within a degree and a half of one.
std::string UpInWords(const Eigen::Vector3d& up);

}  // namespace slcmap::data
