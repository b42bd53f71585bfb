#include "data/pose_form.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/error.h"
#include "data/text_row.h"

namespace slcmap {
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

bool IsOneOf(const std::string& text, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(), [&](const char* name) { return text == name; });
}

}  // namespace

void PoseForm::Check() const {
  Expect(IsOneOf(of, {"imu", "camera", "world-in-imu", "world-in-camera"}), "--poses-of", of,
         "imu, camera, world-in-imu or world-in-camera");
  Expect(IsOneOf(quaternion, {"", "xyzw", "wxyz", "xyzw-conjugated", "wxyz-conjugated"}),
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

std::string OptionsOf(const PoseForm& form) {
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

}  // namespace slcmap
