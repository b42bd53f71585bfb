#include "odometry/options.h"

#include <utility>

#include "data/config_file.h"
#include "data/error.h"
#include "data/option_table.h"

namespace slcmap {

constexpr OptionTable kRectifier{
    Option{"max_field_of_view_rad", &RectifierOptions::max_field_of_view_rad, 0.2, 2.8},
    Option{"scale", &RectifierOptions::scale, 0.1, 4.0}};

void RectifierOptions::Check() const { kRectifier.Check("rectifier", *this); }
void RectifierOptions::Read(YamlSection section) { kRectifier.Read(section, this); }

constexpr OptionTable kPointTracker{
    Option{"max_points", &PointTrackerOptions::max_points, 1, 10000},
    Option{"min_distance_px", &PointTrackerOptions::min_distance_px, 3.0, 1000.0},
    Option{"pyramid_levels", &PointTrackerOptions::pyramid_levels, 1, 8},
    Option{"patch_px", &PointTrackerOptions::patch_px, 5, 63},
    Option{"min_correlation", &PointTrackerOptions::min_correlation, 0.0, 1.0},
    Option{"max_epipolar_px", &PointTrackerOptions::max_epipolar_px, 0.01, 100.0},
    Option{"min_corner_gradient", &PointTrackerOptions::min_corner_gradient, 0.0, 255.0}};

void PointTrackerOptions::Check() const { kPointTracker.Check("points", *this); }
void PointTrackerOptions::Read(YamlSection section) { kPointTracker.Read(section, this); }

constexpr OptionTable kWindow{
    Option{"max_keyframes", &WindowOptions::max_keyframes, 3, 100},
    Option{"point_sigma_px", &WindowOptions::point_sigma_px, 0.01, 20.0},
    Option{"point_loss_sigma", &WindowOptions::point_loss_sigma, 0.1, 100.0},
    Option{"max_point_chi2", &WindowOptions::max_point_chi2, 1.0, 1e6},
    Option{"max_tracking_chi2", &WindowOptions::max_tracking_chi2, 1.0, 1e6},
    Option{"max_iterations", &WindowOptions::max_iterations, 1, 100},
    Option{"max_tracking_iterations", &WindowOptions::max_tracking_iterations, 1, 100},
    Option{"zero_velocity_sigma_m_s", &WindowOptions::zero_velocity_sigma_m_s, 1e-6, 10.0},
    Option{"first_tilt_sigma_rad", &WindowOptions::first_tilt_sigma_rad, 1e-6, 10.0},
    Option{"first_velocity_sigma_m_s", &WindowOptions::first_velocity_sigma_m_s, 1e-6, 1000.0},
    Option{"first_gyro_bias_sigma_rad_s", &WindowOptions::first_gyro_bias_sigma_rad_s, 1e-8, 10.0},
    Option{"first_accel_bias_sigma_m_s2", &WindowOptions::first_accel_bias_sigma_m_s2, 1e-8,
           100.0}};

void WindowOptions::Check() const {
  kWindow.Check("window", *this);
  triangulation.Check();
}
void WindowOptions::Read(YamlSection section) {
  triangulation.Read(section.Section("triangulation"));
  kWindow.Read(section, this);
}

constexpr OptionTable kKeyframe{
    Option{"min_parallax_px", &KeyframeOptions::min_parallax_px, 0.1, 1000.0},
    Option{"min_kept_share", &KeyframeOptions::min_kept_share, 0.0, 1.0},
    Option{"max_interval_s", &KeyframeOptions::max_interval_s, 0.01, 100.0},
    Option{"sparse_share", &KeyframeOptions::sparse_share, 0.0, 1.0},
    Option{"sparse_interval_s", &KeyframeOptions::sparse_interval_s, 0.01, 100.0},
    Option{"still_parallax_px", &KeyframeOptions::still_parallax_px, 0.0, 100.0},
    Option{"max_still_rate_rad_s", &KeyframeOptions::max_still_rate_rad_s, 0.0, 10.0}};

void KeyframeOptions::Check() const { kKeyframe.Check("keyframes", *this); }
void KeyframeOptions::Read(YamlSection section) { kKeyframe.Read(section, this); }

constexpr OptionTable kInitializer{
    Option{"window_s", &InitializerOptions::window_s, 0.1, 10.0},
    Option{"min_points", &InitializerOptions::min_points, 5, 10000},
    Option{"max_still_flow_px", &InitializerOptions::max_still_flow_px, 0.0, 100.0},
    Option{"max_still_accel_sigma_m_s2", &InitializerOptions::max_still_accel_sigma_m_s2, 0.0,
           100.0},
    Option{"max_still_gyro_sigma_rad_s", &InitializerOptions::max_still_gyro_sigma_rad_s, 0.0,
           10.0},
    Option{"max_gravity_error_m_s2", &InitializerOptions::max_gravity_error_m_s2, 0.01, 9.0},
    Option{"max_reprojection_sigma", &InitializerOptions::max_reprojection_sigma, 0.5, 100.0}};

void InitializerOptions::Check() const { kInitializer.Check("initializer", *this); }
void InitializerOptions::Read(YamlSection section) { kInitializer.Read(section, this); }

constexpr OptionTable kCalibration{
    Option{"time_offset", &CalibrationOptions::time_offset, false, true},
    Option{"imu_rotation", &CalibrationOptions::imu_rotation, false, true},
    Option{"lever", &CalibrationOptions::lever, false, true},
    Option{"imu_scale", &CalibrationOptions::imu_scale, false, true},
    Option{"imu_axes", &CalibrationOptions::imu_axes, false, true},
    Option{"right_rotation", &CalibrationOptions::right_rotation, false, true},
    Option{"focal_length", &CalibrationOptions::focal_length, false, true},
    Option{"right_centre", &CalibrationOptions::right_centre, false, true},
    Option{"rows_fit", &CalibrationOptions::rows_fit, false, true},
    Option{"confirm", &CalibrationOptions::confirm, false, true},
    Option{"sigma_scale", &CalibrationOptions::sigma_scale, 1.0, 3.0},
    Option{"time_offset_sigma_s", &CalibrationOptions::time_offset_sigma_s, 1e-6, 0.5},
    Option{"imu_rotation_sigma_rad", &CalibrationOptions::imu_rotation_sigma_rad, 1e-6, 0.5},
    Option{"lever_sigma_m", &CalibrationOptions::lever_sigma_m, 1e-6, 1.0},
    Option{"imu_scale_sigma", &CalibrationOptions::imu_scale_sigma, 1e-6, 0.1},
    Option{"imu_axes_sigma_rad", &CalibrationOptions::imu_axes_sigma_rad, 1e-6, 0.1},
    Option{"right_rotation_sigma_rad", &CalibrationOptions::right_rotation_sigma_rad, 1e-6, 0.1},
    Option{"focal_length_sigma", &CalibrationOptions::focal_length_sigma, 1e-6, 0.1},
    Option{"right_centre_sigma_px", &CalibrationOptions::right_centre_sigma_px, 1e-6, 100.0},
    Option{"max_time_offset_s", &CalibrationOptions::max_time_offset_s, 1e-6, 1.0},
    Option{"max_imu_rotation_rad", &CalibrationOptions::max_imu_rotation_rad, 1e-6, 1.0},
    Option{"max_lever_m", &CalibrationOptions::max_lever_m, 1e-6, 10.0},
    Option{"max_imu_scale", &CalibrationOptions::max_imu_scale, 1e-6, 0.3},
    Option{"max_imu_axes_rad", &CalibrationOptions::max_imu_axes_rad, 1e-6, 0.3},
    Option{"max_right_rotation_rad", &CalibrationOptions::max_right_rotation_rad, 1e-6, 0.2},
    Option{"max_focal_length", &CalibrationOptions::max_focal_length, 1e-6, 0.2},
    Option{"max_right_centre_px", &CalibrationOptions::max_right_centre_px, 1e-6, 100.0}};

void CalibrationOptions::Check() const { kCalibration.Check("calibration", *this); }
void CalibrationOptions::Read(YamlSection section) {
  section.Retire("principal_points");
  kCalibration.Read(section, this);
}

constexpr OptionTable kFailure{
    Option{"min_points", &FailureOptions::min_points, 1, 1000},
    Option{"max_lost_s", &FailureOptions::max_lost_s, 0.05, 1000.0},
    Option{"max_speed_m_s", &FailureOptions::max_speed_m_s, 0.1, 1e4},
    Option{"max_gyro_bias_rad_s", &FailureOptions::max_gyro_bias_rad_s, 1e-4, 10.0},
    Option{"max_accel_bias_m_s2", &FailureOptions::max_accel_bias_m_s2, 1e-3, 100.0},
    Option{"max_imu_gap_s", &FailureOptions::max_imu_gap_s, 0.01, 100.0}};

void FailureOptions::Check() const { kFailure.Check("failure", *this); }
void FailureOptions::Read(YamlSection section) { kFailure.Read(section, this); }

constexpr OptionTable kManhattan{
    Option{"tilt_sigma_rad", &ManhattanOptions::tilt_sigma_rad, 1e-06, 0.2},
    Option{"min_length_px", &ManhattanOptions::min_length_px, 1.0, 10000.0},
    Option{"full_weight_px", &ManhattanOptions::full_weight_px, 1.0, 10000.0},
    Option{"min_vertical_sigmas", &ManhattanOptions::min_vertical_sigmas, 0.0, 100.0},
    Option{"max_vote_sigma_rad", &ManhattanOptions::max_vote_sigma_rad, 0.0001, 0.5},
    Option{"memory_images", &ManhattanOptions::memory_images, 1, 10000},
    Option{"search_step_rad", &ManhattanOptions::search_step_rad, 0.0001, 0.1},
    Option{"search_sigma_rad", &ManhattanOptions::search_sigma_rad, 1e-05, 0.1},
    Option{"max_sigmas", &ManhattanOptions::max_sigmas, 0.5, 10.0},
    Option{"min_separation_rad", &ManhattanOptions::min_separation_rad, 0.01, 0.7},
    Option{"runner_up_separation_rad", &ManhattanOptions::runner_up_separation_rad, 0.01, 0.7},
    Option{"min_images", &ManhattanOptions::min_images, 1, 10000},
    Option{"min_images_below", &ManhattanOptions::min_images_below, 1, 10000},
    Option{"min_image_share", &ManhattanOptions::min_image_share, 0.0, 1.0},
    Option{"min_mean_length_px", &ManhattanOptions::min_mean_length_px, 0.0, 1000000.0},
    Option{"min_overhead_share", &ManhattanOptions::min_overhead_share, 0.0, 1.0},
    Option{"max_runner_up", &ManhattanOptions::max_runner_up, 0.0, 1.0},
    Option{"min_share", &ManhattanOptions::min_share, 0.0, 1.0},
    Option{"min_minor_share", &ManhattanOptions::min_minor_share, 0.0, 0.5},
    Option{"min_one_axis_share", &ManhattanOptions::min_one_axis_share, 0.0, 1.0},
    Option{"min_spread", &ManhattanOptions::min_spread, 0.0, 1.0},
    Option{"min_images_one_axis", &ManhattanOptions::min_images_one_axis, 1, 10000},
    Option{"max_runner_up_one_axis", &ManhattanOptions::max_runner_up_one_axis, 0.0, 1.0},
    Option{"min_given_up", &ManhattanOptions::min_given_up, 1, 1000000},
    Option{"max_given_up_share", &ManhattanOptions::max_given_up_share, 0.0, 1.0}};

void ManhattanOptions::Check() const { kManhattan.Check("manhattan", *this); }
void ManhattanOptions::Read(YamlSection section) { kManhattan.Read(section, this); }

constexpr OptionTable kLineClassifier{
    Option{"end_sigma_px", &LineClassifierOptions::end_sigma_px, 0.01, 20.0},
    Option{"direction_sigma_rad", &LineClassifierOptions::direction_sigma_rad, 1e-06, 0.2},
    Option{"max_sigmas", &LineClassifierOptions::max_sigmas, 0.5, 100.0},
    Option{"max_angle_rad", &LineClassifierOptions::max_angle_rad, 0.001, 0.5},
    Option{"min_other_sigmas", &LineClassifierOptions::min_other_sigmas, 0.5, 100.0}};

void LineClassifierOptions::Check() const { kLineClassifier.Check("line_classifier", *this); }
void LineClassifierOptions::Read(YamlSection section) { kLineClassifier.Read(section, this); }

constexpr OptionTable kSlopes{
    Option{"enabled", &SlopeOptions::enabled, false, true},
    Option{"min_length_m", &SlopeOptions::min_length_m, 0.0, 100.0},
    Option{"max_line_sigma_rad", &SlopeOptions::max_line_sigma_rad, 1e-4, 0.2},
    Option{"min_separation_rad", &SlopeOptions::min_separation_rad, 0.01, 0.7},
    Option{"min_other_sigmas", &SlopeOptions::min_other_sigmas, 0.5, 100.0},
    Option{"memory_keyframes", &SlopeOptions::memory_keyframes, 1, 10000},
    Option{"search_sigma_rad", &SlopeOptions::search_sigma_rad, 1e-5, 0.1},
    Option{"max_sigmas", &SlopeOptions::max_sigmas, 0.5, 10.0},
    Option{"max_angle_rad", &SlopeOptions::max_angle_rad, 1e-3, 0.5},
    Option{"min_lines", &SlopeOptions::min_lines, 2, 10000},
    Option{"min_objects", &SlopeOptions::min_objects, 1, 10000},
    Option{"min_apart_m", &SlopeOptions::min_apart_m, 0.0, 100.0},
    Option{"max_sigma_rad", &SlopeOptions::max_sigma_rad, 1e-4, 0.2},
    Option{"min_given_up", &SlopeOptions::min_given_up, 1, 1000000},
    Option{"max_given_up_share", &SlopeOptions::max_given_up_share, 0.0, 1.0}};

void SlopeOptions::Check() const { kSlopes.Check("slopes", *this); }
void SlopeOptions::Read(YamlSection section) { kSlopes.Read(section, this); }

constexpr OptionTable kPointsOnLines{
    Option{"max_distance_px", &PointsOnLinesOptions::max_distance_px, 0.01, 100.0},
    Option{"min_apart_px", &PointsOnLinesOptions::min_apart_px, 0.01, 100.0},
    Option{"max_beyond_px", &PointsOnLinesOptions::max_beyond_px, 0.0, 1000.0},
    Option{"min_crossing_rad", &PointsOnLinesOptions::min_crossing_rad, 0.0, 1.5},
    Option{"min_keyframes", &PointsOnLinesOptions::min_keyframes, 1, 1000},
    Option{"max_unseen_keyframes", &PointsOnLinesOptions::max_unseen_keyframes, 1, 100000},
    Option{"area_px", &PointsOnLinesOptions::area_px, 4.0, 1000.0}};

void PointsOnLinesOptions::Check() const { kPointsOnLines.Check("points_on_lines", *this); }
void PointsOnLinesOptions::Read(YamlSection section) { kPointsOnLines.Read(section, this); }

constexpr OptionTable kPointTriangulation{
    Option{"min_parallax_rad", &PointTriangulationOptions::min_parallax_rad, 0.0, 1.0},
    Option{"max_residual_sigma", &PointTriangulationOptions::max_residual_sigma, 0.1, 1000.0},
    Option{"min_depth_m", &PointTriangulationOptions::min_depth_m, 1e-3, 100.0},
    Option{"max_depth_m", &PointTriangulationOptions::max_depth_m, 0.1, 1e5}};

void PointTriangulationOptions::Check() const {
  kPointTriangulation.Check("window.triangulation", *this);
  CheckOrder("window.triangulation", "min_depth_m", min_depth_m, "max_depth_m", max_depth_m);
}
void PointTriangulationOptions::Read(YamlSection section) {
  kPointTriangulation.Read(section, this);
}

constexpr OptionTable kLineTriangulation{
    Option{"max_relative_sigma", &LineTriangulationOptions::max_relative_sigma, 1e-3, 10.0},
    Option{"max_direction_sigma_rad", &LineTriangulationOptions::max_direction_sigma_rad, 1e-3,
           1.6},
    Option{"min_distance_m", &LineTriangulationOptions::min_distance_m, 0.0, 100.0},
    Option{"max_distance_m", &LineTriangulationOptions::max_distance_m, 0.1, 1e5},
    Option{"loss_sigma", &LineTriangulationOptions::loss_sigma, 0.1, 1e3}};

void LineTriangulationOptions::Check() const {
  kLineTriangulation.Check("line_landmarks.triangulation", *this);
  CheckOrder("line_landmarks.triangulation", "min_distance_m", min_distance_m, "max_distance_m",
             max_distance_m);
}
void LineTriangulationOptions::Read(YamlSection section) { kLineTriangulation.Read(section, this); }

constexpr OptionTable kBuildingDeviation{
    Option{"start_sigma_rad", &BuildingDeviationOptions::start_sigma_rad, 0.0, 0.1},
    Option{"start_lines", &BuildingDeviationOptions::start_lines, 0.01, 1e9},
    Option{"min_sigma_rad", &BuildingDeviationOptions::min_sigma_rad, 1e-5, 0.1},
    Option{"max_sigma_rad", &BuildingDeviationOptions::max_sigma_rad, 1e-5, 0.1},
    Option{"exact_below_rad", &BuildingDeviationOptions::exact_below_rad, 0.0, 0.1},
    Option{"shared_share", &BuildingDeviationOptions::shared_share, 0.0, 0.95},
    Option{"max_piece_m", &BuildingDeviationOptions::max_piece_m, 0.1, 1e6},
    Option{"shared_radius_m", &BuildingDeviationOptions::shared_radius_m, 0.1, 1000.0},
    Option{"probe_every", &BuildingDeviationOptions::probe_every, 1, 1000000},
    Option{"loss_sigma", &BuildingDeviationOptions::loss_sigma, 0.1, 100.0},
    Option{"max_sigmas", &BuildingDeviationOptions::max_sigmas, 1.0, 1e6}};

void BuildingDeviationOptions::Check() const {
  kBuildingDeviation.Check("building_deviation", *this);
  CheckOrder("building_deviation", "min_sigma_rad", min_sigma_rad, "max_sigma_rad", max_sigma_rad);
  if (start_sigma_rad == 0) return;
  CheckOrder("building_deviation", "min_sigma_rad", min_sigma_rad, "start_sigma_rad",
             start_sigma_rad);
  CheckOrder("building_deviation", "start_sigma_rad", start_sigma_rad, "max_sigma_rad",
             max_sigma_rad);
}
void BuildingDeviationOptions::Read(YamlSection section) { kBuildingDeviation.Read(section, this); }

constexpr OptionTable kLineLandmark{
    Option{"sigma_px", &LineLandmarkOptions::sigma_px, 0.01, 20.0},
    Option{"loss_sigma", &LineLandmarkOptions::loss_sigma, 0.1, 100.0},
    Option{"max_chi2", &LineLandmarkOptions::max_chi2, 1.0, 1e6},
    Option{"max_tracking_chi2", &LineLandmarkOptions::max_tracking_chi2, 1.0, 1e9},
    Option{"max_median_chi2", &LineLandmarkOptions::max_median_chi2, 0.1, 1e6},
    Option{"max_new_chi2", &LineLandmarkOptions::max_new_chi2, 1.0, 1e6},
    Option{"anchor_at_origin", &LineLandmarkOptions::anchor_at_origin, false, true},
    Option{"min_keyframes", &LineLandmarkOptions::min_keyframes, 1, 100},
    Option{"min_general_keyframes", &LineLandmarkOptions::min_general_keyframes, 1, 100},
    Option{"general_above_rad", &LineLandmarkOptions::general_above_rad, 0.0, 1.0},
    Option{"merge_sigmas", &LineLandmarkOptions::merge_sigmas, 0.0, 100.0},
    Option{"min_merge_distance_m", &LineLandmarkOptions::min_merge_distance_m, 0.0, 1.0},
    Option{"max_merge_distance_m", &LineLandmarkOptions::max_merge_distance_m, 0.0, 1.0},
    Option{"max_apart_sigmas", &LineLandmarkOptions::max_apart_sigmas, 0.0, 1e6},
    Option{"point_sigma_m", &LineLandmarkOptions::point_sigma_m, 1e-4, 10.0},
    Option{"max_member_sigma_m", &LineLandmarkOptions::max_member_sigma_m, 1e-4, 100.0},
    Option{"max_unseen", &LineLandmarkOptions::max_unseen, 0, 1000}};

void LineLandmarkOptions::Check() const {
  kLineLandmark.Check("line_landmarks", *this);
  CheckOrder("line_landmarks", "min_merge_distance_m", min_merge_distance_m, "max_merge_distance_m",
             max_merge_distance_m);
  triangulation.Check();
}
void LineLandmarkOptions::Read(YamlSection section) {
  triangulation.Read(section.Section("triangulation"));
  kLineLandmark.Read(section, this);
}

namespace {

// Calls visit(key, struct) for each section of the file, for options that are const or not.
template <typename Options, typename Visit>
void ForEachSection(Options& options, const Visit& visit) {
  visit("rectifier", options.rectifier);
  visit("points", options.points);
  visit("window", options.window);
  visit("keyframes", options.keyframes);
  visit("initializer", options.initializer);
  visit("calibration", options.calibration);
  visit("failure", options.failure);
  visit("lines", options.lines);
  visit("manhattan", options.manhattan);
  visit("line_classifier", options.line_classifier);
  visit("slopes", options.slopes);
  visit("points_on_lines", options.points_on_lines);
  visit("line_landmarks", options.line_landmarks);
  visit("building_deviation", options.building_deviation);
}

}  // namespace

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
    Option{"scale", &LineDetectorOptions::scale, 0.1, 1.0},
    Option{"min_length_px", &LineDetectorOptions::min_length_px, 10.0, 1000.0},
    Option{"max_join_gap_px", &LineDetectorOptions::max_join_gap_px, 0.0, 1000.0},
    Option{"max_segments", &LineDetectorOptions::max_segments, 1, 10000}};

void LineDetectorOptions::Check() const { kLineDetector.Check("lines.detector", *this); }
void LineDetectorOptions::Read(YamlSection section) {
  std::string name = LineDetectorName(kind);
  section.Read("kind", &name);
  kind = LineDetectorFromName(name);
  kLineDetector.Read(section, this);
}

constexpr OptionTable kLineMatcher{
    Option{"max_descriptor_bits", &LineMatcherOptions::max_descriptor_bits, 0, 256},
    Option{"min_lead_bits", &LineMatcherOptions::min_lead_bits, 0.0, 256.0},
    Option{"min_correlation", &LineMatcherOptions::min_correlation, 0.0, 1.0},
    Option{"min_stereo_correlation", &LineMatcherOptions::min_stereo_correlation, 0.0, 1.0},
    Option{"min_stereo_lead", &LineMatcherOptions::min_stereo_lead, 0.0, 1.0},
    Option{"max_disparity", &LineMatcherOptions::max_disparity, 0.01, 1.0}};

void LineMatcherOptions::Check() const { kLineMatcher.Check("lines.matcher", *this); }
void LineMatcherOptions::Read(YamlSection section) { kLineMatcher.Read(section, this); }

constexpr OptionTable kLineTracker{
    Option{"max_lines", &LineTrackerOptions::max_lines, 1, 1000},
    Option{"max_misses", &LineTrackerOptions::max_misses, 0, 1000},
    Option{"gate_sigmas", &LineTrackerOptions::gate_sigmas, 0.0, 100.0},
    Option{"min_gate_px", &LineTrackerOptions::min_gate_px, 0.1, 100.0},
    Option{"predicted_angle_rad", &LineTrackerOptions::predicted_angle_rad, 0.001, 1.0},
    Option{"max_parallax_px", &LineTrackerOptions::max_parallax_px, 1.0, 1000.0},
    Option{"moved_angle_rad", &LineTrackerOptions::moved_angle_rad, 0.001, 1.0}};

void LineTrackerOptions::Check() const {
  kLineTracker.Check("lines", *this);
  detector.Check();
  matcher.Check();
}
void LineTrackerOptions::Read(YamlSection section) {
  detector.Read(section.Section("detector"));
  matcher.Read(section.Section("matcher"));
  kLineTracker.Read(section, this);
}

OdometryOptions OdometryOptions::FromYaml(const std::string& path) {
  return ReadConfigFile(path, [](YamlSection& root) {
    OdometryOptions options;
    std::string method = MethodName(options.method);
    root.Read("method", &method);
    options.method = MethodFromName(method);
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root.Section(key)); });
    options.Check();
    return options;
  });
}

std::string OdometryOptions::ToYaml() const {
  OdometryOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) {
    std::string method = MethodName(options.method);
    root->Read("method", &method);
    ForEachSection(options,
                   [&](const char* key, auto& section) { section.Read(root->Section(key)); });
  });
}

void OdometryOptions::Check() const {
  ForEachSection(*this, [](const char*, const auto& section) { section.Check(); });
}

}  // namespace slcmap
