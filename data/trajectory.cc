#include "data/trajectory.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "data/error.h"
#include "data/pose_file.h"
#include "data/text_row.h"

namespace slcmap {
namespace {

constexpr double kMaxNormError = 0.01;  // of a quaternion as written

constexpr int64_t kMaxStamp_ns = int64_t{1} << 62;  // differences of two stamps stay within range

StampedPose ParseRow(const std::vector<std::string_view>& fields, const std::string& place) {
  if (fields.size() < 8) {
    throw DataError(fmt::format("{}: found {} columns, expected 8: stamp_s x y z qx qy qz qw",
                                place, fields.size()));
  }
  StampedPose pose;
  const std::optional<int64_t> stamp_ns = ParseScaledInteger(fields[0], 9);
  if (!stamp_ns || std::abs(*stamp_ns) > kMaxStamp_ns) {
    throw DataError(fmt::format("{}: found '{}', expected a stamp", place, fields[0]));
  }
  pose.stamp_ns = *stamp_ns;
  std::array<double, 7> v;
  for (size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> value = ParseNumber(fields[i + 1]);
    if (!value || !std::isfinite(*value)) {
      throw DataError(fmt::format("{}: found '{}' in column {}, expected a finite number", place,
                                  fields[i + 1], i + 2));
    }
    v[i] = *value;
  }
  pose.T_world_imu.translation = Eigen::Vector3d(v[0], v[1], v[2]);
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1) > kMaxNormError) {
    throw DataError(
        fmt::format("{}: found a quaternion of norm {:.4g}, expected 1", place, q.norm()));
  }
  pose.T_world_imu.rotation = q.normalized();
  return pose;
}

}  // namespace

Trajectory ReadTumTrajectory(const std::string& path) {
  Trajectory trajectory;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::string place = fmt::format("{}: row {}", path, row);
    const StampedPose pose = ParseRow(fields, place);
    if (!trajectory.empty() && pose.stamp_ns <= trajectory.back().stamp_ns) {
      throw DataError(
          fmt::format("{}: found stamp {} not after {} of the row before, expected "
                      "sorted stamps",
                      place, pose.stamp_ns, trajectory.back().stamp_ns));
    }
    trajectory.push_back(pose);
  });
  if (trajectory.empty()) throw DataError(path + ": found no pose, expected at least one row");
  return trajectory;
}

Trajectory ReadTrajectory(const std::string& path) {
  return PosesOf(ReadPoseTable(path, {}), {}, std::nullopt);
}

std::string TumRow(const StampedPose& pose) {
  const bool negative = pose.stamp_ns < 0;
  const uint64_t stamp_ns = negative ? -static_cast<uint64_t>(pose.stamp_ns) : pose.stamp_ns;
  const Eigen::Vector3d& p = pose.T_world_imu.translation;
  const Eigen::Quaterniond& q = pose.T_world_imu.rotation;
  const double sign = q.w() < 0 ? -1 : 1;  // one sign for one rotation
  return fmt::format("{}{}.{:09} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                     negative ? "-" : "", stamp_ns / 1000000000, stamp_ns % 1000000000, p.x(),
                     p.y(), p.z(), sign * q.x(), sign * q.y(), sign * q.z(), sign * q.w());
}

void WriteTumTrajectory(const std::string& path, const Trajectory& trajectory) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file << kTumHeader;
  for (const StampedPose& pose : trajectory) file << TumRow(pose);
  file.close();
  if (!file) throw OutputError(path + ": cannot be written: " + std::strerror(errno));
}

std::optional<RigidTransform> PoseAt(const Trajectory& trajectory, int64_t stamp_ns,
                                     double max_gap_s) {
  const auto after = std::lower_bound(
      trajectory.begin(), trajectory.end(), stamp_ns,
      [](const StampedPose& pose, int64_t stamp) { return pose.stamp_ns < stamp; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return after->T_world_imu;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = after - 1;
  const int64_t gap_ns = after->stamp_ns - before->stamp_ns;
  if (ToSeconds(gap_ns) > max_gap_s) return std::nullopt;
  const double u = static_cast<double>(stamp_ns - before->stamp_ns) / static_cast<double>(gap_ns);
  return Interpolate(before->T_world_imu, after->T_world_imu, u);
}

}  // namespace slcmap
