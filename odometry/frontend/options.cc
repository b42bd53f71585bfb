#include "odometry/frontend/options.h"

#include <utility>

#include "data/core/error.h"
#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kRectifier{
    Option{"max_field_of_view_rad", &RectifierOptions::max_field_of_view_rad, 0.2, 2.8},
    Option{"scale", &RectifierOptions::scale, 0.1, 4.0}};

void RectifierOptions::Check() const { kRectifier.Check("rectifier", *this); }
void RectifierOptions::Read(YamlSection section) { kRectifier.Read(section, this); }

constexpr OptionTable kPointTracker{
    Option{"max_points", &PointTrackerOptions::max_points, 1, 10000},
    Option{"min_distance_px", &PointTrackerOptions::min_distance_px, 3.0, 1000.0},
    Option{"min_corner_gradient", &PointTrackerOptions::min_corner_gradient, 0.0, 255.0}};

void PointTrackerOptions::Check() const { kPointTracker.Check("points", *this); }
void PointTrackerOptions::Read(YamlSection section) {
  kPointTracker.Read(section, this,
                     {"min_correlation", "max_epipolar_px", "pyramid_levels", "patch_px"});
}

constexpr std::pair<LineDetectorKind, const char*> kLineDetectors[] = {
    {LineDetectorKind::kLsd, "lsd"},
    {LineDetectorKind::kFld, "fld"},
    {LineDetectorKind::kEd, "ed"}};

LineDetectorKind LineDetectorFromName(const std::string& name) {
  for (const auto& [kind, kind_name] : kLineDetectors) {
    if (name == kind_name) return kind;
  }
  throw ConfigError("lines.detector.kind: found '" + name + "', expected lsd, fld or ed");
}

std::string LineDetectorName(LineDetectorKind kind) {
  for (const auto& [other, name] : kLineDetectors) {
    if (kind == other) return name;
  }
  return "";
}

constexpr OptionTable kLineDetector{
    Option{"min_length_px", &LineDetectorOptions::min_length_px, 10.0, 1000.0}};

void LineDetectorOptions::Check() const { kLineDetector.Check("lines.detector", *this); }
void LineDetectorOptions::Read(YamlSection section) {
  std::string name = LineDetectorName(kind);
  section.Read("kind", &name);
  kind = LineDetectorFromName(name);
  kLineDetector.Read(section, this, {"scale", "max_join_gap_px", "max_segments"});
}

constexpr OptionTable kLineTracker{Option{"max_lines", &LineTrackerOptions::max_lines, 1, 1000}};

void LineTrackerOptions::Check() const {
  kLineTracker.Check("lines", *this);
  detector.Check();
}
void LineTrackerOptions::Read(YamlSection section) {
  detector.Read(section.Section("detector"));
  kLineTracker.Read(section, this,
                    {"matcher", "max_misses", "gate_sigmas", "min_gate_px", "predicted_angle_rad",
                     "max_parallax_px", "moved_angle_rad"});
}

}  // namespace slcmap::odometry
