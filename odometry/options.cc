#include "odometry/options.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "data/core/error.h"
#include "data/io/yaml.h"
#include "odometry/factors/options.h"
#include "odometry/frontend/options.h"
#include "odometry/structure/options.h"
#include "odometry/window/options.h"

namespace slcmap::inline odometry {
namespace {

// Calls visit(key, struct) for each section of the file, for options that are const or not.
template <typename Options, typename Visit>
void ForEachSection(Options& options, const Visit& visit) {
  visit("rectifier", options.rectifier);
  visit("points", options.points);
  visit("window", options.window);
  visit("keyframes", options.keyframes);
  visit("calibration", options.calibration);
  visit("failure", options.failure);
  visit("lines", options.lines);
  visit("slopes", options.slopes);
  visit("line_landmarks", options.line_landmarks);
  visit("building_deviation", options.building_deviation);
}

}  // namespace

OdometryOptions OdometryOptions::FromYaml(const std::string& path) {
  return ReadConfigFile(path, ConfigOrigin::kUser, [](YamlSection& root) {
    OdometryOptions options;
    std::string method = MethodName(options.method);
    root.Read("method", &method);
    options.method = MethodFromName(method);
    root.Retire({"initializer", "manhattan", "line_classifier", "points_on_lines"});
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root.Section(key)); });
    options.Check();
    return options;
  });
}

std::string OdometryOptions::ToYaml() const {
  OdometryOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) {
    std::string name = MethodName(options.method);
    root->Read("method", &name);
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root->Section(key)); });
  });
}

void OdometryOptions::Check() const {
  ForEachSection(*this, [](const char*, const auto& section) { section.Check(); });
}

constexpr OptionTable kCalibration{
    Option{"time_offset", &CalibrationOptions::time_offset, false, true},
    Option{"imu_rotation", &CalibrationOptions::imu_rotation, false, true},
    Option{"lever", &CalibrationOptions::lever, false, true},
    Option{"imu_scale", &CalibrationOptions::imu_scale, false, true},
    Option{"imu_axes", &CalibrationOptions::imu_axes, false, true},
    Option{"right_rotation", &CalibrationOptions::right_rotation, false, true},
    Option{"focal_length", &CalibrationOptions::focal_length, false, true},
    Option{"right_centre", &CalibrationOptions::right_centre, false, true},
    Option{"readout", &CalibrationOptions::readout, false, true}};

void CalibrationOptions::Check() const { kCalibration.Check("calibration", *this); }
void CalibrationOptions::Read(YamlSection section) {
  // Keys of an earlier version.
  section.Retire({"principal_points", "rows_fit", "confirm", "sigma_scale", "time_offset_sigma_s",
                  "imu_rotation_sigma_rad", "lever_sigma_m", "imu_scale_sigma"});
  section.Retire({"imu_axes_sigma_rad", "right_rotation_sigma_rad", "focal_length_sigma"});
  section.Retire({"right_centre_sigma_px", "readout_sigma_s", "max_time_offset_s", "max_lever_m"});
  section.Retire({"max_imu_rotation_rad", "max_imu_scale", "max_imu_axes_rad", "max_focal_length"});
  kCalibration.Read(section, this, {"max_right_rotation_rad", "max_right_centre_px"});
}

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

constexpr OptionTable kLineDetector{
    Option{"min_length_px", &LineDetectorOptions::min_length_px, 10.0, 1000.0}};

void LineDetectorOptions::Check() const { kLineDetector.Check("lines.detector", *this); }
void LineDetectorOptions::Read(YamlSection section) {
  std::string name;
  for (const auto& [known, known_name] : kLineDetectors) {
    if (known == kind) name = known_name;
  }
  section.Read("kind", &name);
  const auto named =
      std::ranges::find(kLineDetectors, name, [](const auto& d) { return d.second; });
  if (named == std::end(kLineDetectors)) {
    throw ConfigError("lines.detector.kind: found '" + name + "', expected lsd, fld or ed");
  }
  kind = named->first;
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

constexpr OptionTable kSlopes{Option{"enabled", &SlopeOptions::enabled, false, true}};

void SlopeOptions::Check() const { kSlopes.Check("slopes", *this); }
void SlopeOptions::Read(YamlSection section) {
  kSlopes.Read(
      section, this,
      {"min_length_m", "max_line_sigma_rad", "min_separation_rad", "min_other_sigmas",
       "memory_keyframes", "search_sigma_rad", "max_sigmas", "max_angle_rad", "min_objects",
       "min_lines", "min_apart_m", "max_sigma_rad", "min_given_up", "max_given_up_share"});
}

constexpr OptionTable kBuildingDeviation{
    Option{"start_sigma_rad", &BuildingDeviationOptions::start_sigma_rad, 0.0, 0.1}};

void BuildingDeviationOptions::Check() const {
  kBuildingDeviation.Check("building_deviation", *this);
  if (start_sigma_rad == 0 ||
      (start_sigma_rad >= min_sigma_rad && start_sigma_rad <= max_sigma_rad)) {
    return;
  }
  throw ConfigError(
      fmt::format("building_deviation.start_sigma_rad: found {}, expected 0, or {} to {}",
                  start_sigma_rad, min_sigma_rad, max_sigma_rad));
}
void BuildingDeviationOptions::Read(YamlSection section) {
  kBuildingDeviation.Read(
      section, this,
      {"start_lines", "probe_every", "shared_radius_m", "loss_sigma", "min_sigma_rad",
       "max_sigma_rad", "exact_below_rad", "shared_share", "max_piece_m", "max_sigmas"});
}

constexpr OptionTable kWindow{Option{"max_keyframes", &WindowOptions::max_keyframes, 3, 100},
                              Option{"point_sigma_px", &WindowOptions::point_sigma_px, 0.01, 20.0}};

void WindowOptions::Check() const { kWindow.Check("window", *this); }
void WindowOptions::Read(YamlSection section) {
  kWindow.Read(
      section, this,
      {"point_loss_sigma", "max_point_chi2", "max_tracking_iterations", "first_tilt_sigma_rad",
       "first_velocity_sigma_m_s", "first_gyro_bias_sigma_rad_s", "first_accel_bias_sigma_m_s2",
       "triangulation", "max_tracking_chi2", "max_iterations", "zero_velocity_sigma_m_s"});
}

constexpr OptionTable kKeyframe{
    Option{"min_parallax_px", &KeyframeOptions::min_parallax_px, 0.1, 1000.0},
    Option{"max_interval_s", &KeyframeOptions::max_interval_s, 0.01, 100.0}};

void KeyframeOptions::Check() const { kKeyframe.Check("keyframes", *this); }
void KeyframeOptions::Read(YamlSection section) {
  kKeyframe.Read(section, this,
                 {"sparse_share", "sparse_interval_s", "still_parallax_px", "max_still_rate_rad_s",
                  "min_kept_share"});
}

constexpr OptionTable kFailure{Option{"max_lost_s", &FailureOptions::max_lost_s, 0.05, 1000.0},
                               Option{"max_speed_m_s", &FailureOptions::max_speed_m_s, 0.1, 1e4}};

void FailureOptions::Check() const { kFailure.Check("failure", *this); }
void FailureOptions::Read(YamlSection section) {
  kFailure.Read(section, this,
                {"max_gyro_bias_rad_s", "max_accel_bias_m_s2", "max_imu_gap_s", "min_points"});
}

constexpr OptionTable kLineLandmark{
    Option{"sigma_px", &LineLandmarkOptions::sigma_px, 0.01, 20.0},
    Option{"anchor_at_origin", &LineLandmarkOptions::anchor_at_origin, false, true}};

void LineLandmarkOptions::Check() const { kLineLandmark.Check("line_landmarks", *this); }
void LineLandmarkOptions::Read(YamlSection section) {
  kLineLandmark.Read(section, this,
                     {"min_keyframes", "min_general_keyframes", "general_above_rad", "merge_sigmas",
                      "min_merge_distance_m", "max_merge_distance_m", "max_apart_sigmas",
                      "max_unseen", "triangulation", "loss_sigma", "max_chi2", "max_tracking_chi2",
                      "max_median_chi2", "max_new_chi2", "point_sigma_m", "max_member_sigma_m"});
}

}  // namespace slcmap::odometry
