#include "odometry/options.h"

#include <sstream>

#include "data/error.h"

namespace slcmap {
namespace {

// Throws unless low <= value <= high.
template <typename T>
void CheckRange(const std::string& key, T value, T low, T high) {
  if (value >= low && value <= high) return;
  std::ostringstream message;
  message << key << ": found " << value << ", expected " << low << " to " << high;
  throw ConfigError(message.str());
}

}  // namespace

Method MethodFromName(const std::string& name) {
  for (const Method method : {Method::kPoints, Method::kPointsMono}) {
    if (MethodName(method) == name) return method;
  }
  throw ConfigError("method: found '" + name + "', expected points or points-mono");
}

std::string MethodName(Method method) {
  return method == Method::kPointsMono ? "points-mono" : "points";
}

void RectifierOptions::Check() const {
  CheckRange("rectifier.max_field_of_view_rad", max_field_of_view_rad, 0.2, 2.8);
  CheckRange("rectifier.scale", scale, 0.1, 4.0);
}

void RectifierOptions::Read(YamlSection section) {
  section.Read("max_field_of_view_rad", &max_field_of_view_rad);
  section.Read("scale", &scale);
  section.Finish();
}

void PointTrackerOptions::Check() const {
  CheckRange("points.max_points", max_points, 1, 10000);
  CheckRange("points.min_distance_px", min_distance_px, 3.0, 1000.0);
  CheckRange("points.pyramid_levels", pyramid_levels, 1, 8);
  CheckRange("points.patch_px", patch_px, 5, 63);
  CheckRange("points.min_correlation", min_correlation, 0.0, 1.0);
  CheckRange("points.max_epipolar_px", max_epipolar_px, 0.01, 100.0);
  CheckRange("points.min_corner_gradient", min_corner_gradient, 0.0, 255.0);
}

void PointTrackerOptions::Read(YamlSection section) {
  section.Read("max_points", &max_points);
  section.Read("min_distance_px", &min_distance_px);
  section.Read("pyramid_levels", &pyramid_levels);
  section.Read("patch_px", &patch_px);
  section.Read("min_correlation", &min_correlation);
  section.Read("max_epipolar_px", &max_epipolar_px);
  section.Read("min_corner_gradient", &min_corner_gradient);
  section.Finish();
}

void WindowOptions::Check() const {
  CheckRange("window.max_keyframes", max_keyframes, 3, 100);
  CheckRange("window.point_sigma_px", point_sigma_px, 0.01, 20.0);
  CheckRange("window.point_loss_sigma", point_loss_sigma, 0.1, 100.0);
  CheckRange("window.max_point_chi2", max_point_chi2, 1.0, 1e6);
  CheckRange("window.max_tracking_chi2", max_tracking_chi2, 1.0, 1e6);
  CheckRange("window.max_iterations", max_iterations, 1, 100);
  CheckRange("window.max_tracking_iterations", max_tracking_iterations, 1, 100);
  CheckRange("window.zero_velocity_sigma_m_s", zero_velocity_sigma_m_s, 1e-6, 10.0);
  CheckRange("window.first_tilt_sigma_rad", first_tilt_sigma_rad, 1e-6, 10.0);
  CheckRange("window.first_velocity_sigma_m_s", first_velocity_sigma_m_s, 1e-6, 1000.0);
  CheckRange("window.first_gyro_bias_sigma_rad_s", first_gyro_bias_sigma_rad_s, 1e-8, 10.0);
  CheckRange("window.first_accel_bias_sigma_m_s2", first_accel_bias_sigma_m_s2, 1e-8, 100.0);
}

void WindowOptions::Read(YamlSection section) {
  section.Read("max_keyframes", &max_keyframes);
  section.Read("point_sigma_px", &point_sigma_px);
  section.Read("point_loss_sigma", &point_loss_sigma);
  section.Read("max_point_chi2", &max_point_chi2);
  section.Read("max_tracking_chi2", &max_tracking_chi2);
  section.Read("max_iterations", &max_iterations);
  section.Read("max_tracking_iterations", &max_tracking_iterations);
  section.Read("zero_velocity_sigma_m_s", &zero_velocity_sigma_m_s);
  section.Read("first_tilt_sigma_rad", &first_tilt_sigma_rad);
  section.Read("first_velocity_sigma_m_s", &first_velocity_sigma_m_s);
  section.Read("first_gyro_bias_sigma_rad_s", &first_gyro_bias_sigma_rad_s);
  section.Read("first_accel_bias_sigma_m_s2", &first_accel_bias_sigma_m_s2);
  section.Finish();
}

void KeyframeOptions::Check() const {
  CheckRange("keyframes.min_parallax_px", min_parallax_px, 0.1, 1000.0);
  CheckRange("keyframes.min_kept_share", min_kept_share, 0.0, 1.0);
  CheckRange("keyframes.max_interval_s", max_interval_s, 0.01, 100.0);
  CheckRange("keyframes.still_parallax_px", still_parallax_px, 0.0, 100.0);
}

void KeyframeOptions::Read(YamlSection section) {
  section.Read("min_parallax_px", &min_parallax_px);
  section.Read("min_kept_share", &min_kept_share);
  section.Read("max_interval_s", &max_interval_s);
  section.Read("still_parallax_px", &still_parallax_px);
  section.Finish();
}

void InitializerOptions::Check() const {
  CheckRange("initializer.window_s", window_s, 0.1, 10.0);
  CheckRange("initializer.min_points", min_points, 5, 10000);
  CheckRange("initializer.max_still_flow_px", max_still_flow_px, 0.0, 100.0);
  CheckRange("initializer.max_still_accel_sigma_m_s2", max_still_accel_sigma_m_s2, 0.0, 100.0);
  CheckRange("initializer.max_still_gyro_sigma_rad_s", max_still_gyro_sigma_rad_s, 0.0, 10.0);
  CheckRange("initializer.max_gravity_error_m_s2", max_gravity_error_m_s2, 0.01, 9.0);
  CheckRange("initializer.max_reprojection_sigma", max_reprojection_sigma, 0.5, 100.0);
}

void InitializerOptions::Read(YamlSection section) {
  section.Read("window_s", &window_s);
  section.Read("min_points", &min_points);
  section.Read("max_still_flow_px", &max_still_flow_px);
  section.Read("max_still_accel_sigma_m_s2", &max_still_accel_sigma_m_s2);
  section.Read("max_still_gyro_sigma_rad_s", &max_still_gyro_sigma_rad_s);
  section.Read("max_gravity_error_m_s2", &max_gravity_error_m_s2);
  section.Read("max_reprojection_sigma", &max_reprojection_sigma);
  section.Finish();
}

void FailureOptions::Check() const {
  CheckRange("failure.min_points", min_points, 1, 1000);
  CheckRange("failure.max_lost_s", max_lost_s, 0.05, 1000.0);
  CheckRange("failure.max_speed_m_s", max_speed_m_s, 0.1, 1e4);
  CheckRange("failure.max_gyro_bias_rad_s", max_gyro_bias_rad_s, 1e-4, 10.0);
  CheckRange("failure.max_accel_bias_m_s2", max_accel_bias_m_s2, 1e-3, 100.0);
  CheckRange("failure.max_imu_gap_s", max_imu_gap_s, 0.01, 100.0);
}

void FailureOptions::Read(YamlSection section) {
  section.Read("min_points", &min_points);
  section.Read("max_lost_s", &max_lost_s);
  section.Read("max_speed_m_s", &max_speed_m_s);
  section.Read("max_gyro_bias_rad_s", &max_gyro_bias_rad_s);
  section.Read("max_accel_bias_m_s2", &max_accel_bias_m_s2);
  section.Read("max_imu_gap_s", &max_imu_gap_s);
  section.Finish();
}

OdometryOptions OdometryOptions::FromYaml(const std::string& path) {
  OdometryOptions options;
  YamlSection root = YamlSection::FromFile(path);
  std::string method = MethodName(options.method);
  root.Read("method", &method);
  options.method = MethodFromName(method);
  options.rectifier.Read(root.Section("rectifier"));
  options.points.Read(root.Section("points"));
  options.window.Read(root.Section("window"));
  options.keyframes.Read(root.Section("keyframes"));
  options.initializer.Read(root.Section("initializer"));
  options.failure.Read(root.Section("failure"));
  root.Section("mapping");  // one file may hold the options of all stages; this is the map's
  root.Finish();
  options.Check();
  return options;
}

void OdometryOptions::Check() const {
  rectifier.Check();
  points.Check();
  window.Check();
  keyframes.Check();
  initializer.Check();
  failure.Check();
}

}  // namespace slcmap
