// Trajectories of the IMU body: TUM and EuRoC files in, TUM files out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/types.h"

namespace slcmap {

struct StampedPose {
  int64_t stamp_ns = 0;
  RigidTransform T_world_imu;
};

using Trajectory = std::vector<StampedPose>;  // sorted by stamp, no stamp twice

// Reads "stamp_s x y z qx qy qz qw" rows; '#' starts a comment; commas and CRLF are accepted.
// Stamps are parsed as decimal text, so that nanoseconds survive. Throws DataError naming file and
// row on a row that cannot be read, on NaN, on unsorted stamps and on an empty file.
Trajectory ReadTumTrajectory(const std::string& path);

// Reads a file of either form, or as others write them (ReadPoseTable in data/pose_file.h), as it
// is.
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

}  // namespace slcmap
