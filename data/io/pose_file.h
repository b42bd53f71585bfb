// Files of poses by others: TUM, EuRoC, KITTI, and tables with a header.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/io/trajectory.h"

namespace slcmap::inline data {

// A row as it stands in the file; of a matrix, its rotation.
struct PoseRow {
  int64_t stamp_ns = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  std::array<double, 4> quaternion = {};  // in the file's order
};

struct PoseTable {
  std::string path;
  std::vector<PoseRow> rows;  // by stamp, no stamp twice
  bool is_scalar_first = false;
  bool is_matrix = false;  // rows hold rotations as matrices: no order of a quaternion to mistake
};

// The times that the poses should be at, sorted: those of images, or of true poses.
using Clock = std::vector<int64_t>;

// Reads a file of poses. The first row tells the form: EuRoC's (stamp_ns, x, y, z, qw, qx, qy, qz)
// where commas separate and the stamp has no point, else TUM's (stamp_s x y z qx qy qz qw); a
// header, with '#' or without, tells the columns by their names; rows of 12 numbers are KITTI's,
// which have the stamps of `clock` where it has as many. Rows of NaN count, and are left out.
// Stamps that are numbers of images are taken where the clock is theirs, else where it has as many.
// Stamps keep their nanoseconds. Their unit is that by which they are at a rate of poses and share
// most time with the clock, after the form's offset, or whatever their start if none does;
// DataError where two do. What is told by that, rows out of order and repeated ones are said as
// warnings. Throws DataError naming file and row, what was found and what was expected.
PoseTable ReadPoseTable(const std::string& path, const PoseForm& form, const Clock& clock = {},
                        bool is_of_images = true);

// The table's poses of the IMU: with offset, scale, and the world turned so that up is z.
// T_imu_camera is that of the left camera; throws ConfigError where the form needs it and there is
// none.
Trajectory CollectPoses(const PoseTable& table, const PoseForm& form,
                        const std::optional<RigidTransform>& T_imu_camera);

// The turn that brings `up` to z, by the shortest way.
Eigen::Quaterniond TurnUp(const Eigen::Vector3d& up);

// Poses far from the origin of their world, as in UTM coordinates, are moved near to it by whole
// metres: what was subtracted. Zero for those within 10 km of the origin.
Eigen::Vector3d MoveNearOrigin(Trajectory* trajectory);

}  // namespace slcmap::data
