#include "data/io/trajectory.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/pose_file.h"

namespace slcmap::inline data {
Trajectory ReadTrajectory(const std::string& path) {
  return CollectPoses(ReadPoseTable(path, {}), {}, std::nullopt);
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
  std::string text = kTumHeader;
  for (const StampedPose& pose : trajectory) text += TumRow(pose);
  WriteFile(path, text);
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

std::optional<RigidTransform> PoseNear(const Trajectory& trajectory, int64_t stamp_ns,
                                       double max_gap_s, double max_offset_s) {
  if (const auto between = PoseAt(trajectory, stamp_ns, max_gap_s)) return between;
  const auto after = std::ranges::lower_bound(trajectory, stamp_ns, {}, &StampedPose::stamp_ns);
  const int64_t most_ns = ToNanoseconds(max_offset_s);
  if (after != trajectory.end() && after->stamp_ns - stamp_ns <= most_ns) return after->T_world_imu;
  if (after != trajectory.begin() && stamp_ns - std::prev(after)->stamp_ns <= most_ns) {
    return std::prev(after)->T_world_imu;
  }
  return std::nullopt;
}

double MedianPeriod_s(const Trajectory& trajectory) {
  std::vector<double> periods_s;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    periods_s.push_back(ToSeconds(trajectory[i].stamp_ns - trajectory[i - 1].stamp_ns));
  }
  return Quantile(std::move(periods_s), 0.5);
}

namespace {

struct NamedAxis {
  const char* name;
  Eigen::Vector3d direction;
};

const std::array<NamedAxis, 6>& Axes() {
  static const std::array<NamedAxis, 6> axes = {{{"z", Eigen::Vector3d::UnitZ()},
                                                 {"-z", -Eigen::Vector3d::UnitZ()},
                                                 {"y", Eigen::Vector3d::UnitY()},
                                                 {"-y", -Eigen::Vector3d::UnitY()},
                                                 {"x", Eigen::Vector3d::UnitX()},
                                                 {"-x", -Eigen::Vector3d::UnitX()}}};
  return axes;
}

void Expect(bool is_right, const char* option, const std::string& found, const char* expected) {
  if (is_right) return;
  throw ConfigError(fmt::format("{}: found '{}', expected {}", option, found, expected));
}

bool MatchesAny(const std::string& text, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(), [&](const char* name) { return text == name; });
}

}  // namespace

void PoseForm::Check() const {
  Expect(MatchesAny(of, {"imu", "camera", "world-in-imu", "world-in-camera"}), "--poses-of", of,
         "imu, camera, world-in-imu or world-in-camera");
  Expect(MatchesAny(quaternion, {"", "xyzw", "wxyz", "xyzw-conjugated", "wxyz-conjugated"}),
         "--quaternion", quaternion, "xyzw, wxyz, xyzw-conjugated or wxyz-conjugated");
  Expect(std::isfinite(scale) && scale > 0, "--poses-scale", fmt::format("{}", scale),
         "a number above 0: metres a unit of the file");
  Expect(std::isfinite(offset_s) && std::abs(offset_s) < 4e9, "--poses-offset",
         fmt::format("{}", offset_s), "seconds, to be added to the stamps");
  Up();
}

Eigen::Vector3d PoseForm::Up() const {
  for (const NamedAxis& axis : Axes()) {
    if (up == axis.name) return axis.direction;
  }
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  const auto fields = SplitRow(up);
  for (size_t i = 0; i < fields.size() && i < 3; ++i) {
    direction[static_cast<Eigen::Index>(i)] = ParseNumber(fields[i]).value_or(NAN);
  }
  Expect(fields.size() == 3 && direction.allFinite() && direction.norm() > 1e-3, "--up", up,
         "z, -z, y, -y, x, -x, or the direction of up as x,y,z in the world of the poses");
  return direction.normalized();
}

std::string FormatOptions(const PoseForm& form) {
  const PoseForm usual;
  std::string options;
  const auto add = [&](const std::string& option) {
    options += (options.empty() ? "" : " ") + option;
  };
  if (form.of != usual.of) add("--poses-of " + form.of);
  if (form.quaternion != usual.quaternion) add("--quaternion " + form.quaternion);
  if (form.up != usual.up) add("--up=" + form.up);
  if (form.scale != usual.scale) add(fmt::format("--poses-scale {:.4g}", form.scale));
  if (form.stamps != usual.stamps) add("--poses-stamps " + form.stamps);
  if (form.offset_s != usual.offset_s) add(fmt::format("--poses-offset={:.3f}", form.offset_s));
  return options;
}

std::string UpInWords(const Eigen::Vector3d& up) {
  constexpr double kSame_rad = 1.5 * M_PI / 180;
  for (const NamedAxis& axis : Axes()) {
    if (axis.direction.dot(up.normalized()) > std::cos(kSame_rad)) return axis.name;
  }
  const Eigen::Vector3d u = up.normalized();
  return fmt::format("{:.4f},{:.4f},{:.4f}", u.x(), u.y(), u.z());
}

}  // namespace slcmap::data
