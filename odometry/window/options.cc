#include "odometry/window/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kPointTriangulation{
    Option{"max_residual_sigma", &PointTriangulationOptions::max_residual_sigma, 0.1, 1000.0},
    Option{"min_depth_m", &PointTriangulationOptions::min_depth_m, 1e-3, 100.0},
    Option{"max_depth_m", &PointTriangulationOptions::max_depth_m, 0.1, 1e5}};

void PointTriangulationOptions::Check() const {
  kPointTriangulation.Check("window.triangulation", *this);
  CheckOrder("window.triangulation", "min_depth_m", min_depth_m, "max_depth_m", max_depth_m);
}
void PointTriangulationOptions::Read(YamlSection section) {
  kPointTriangulation.Read(section, this, {"min_parallax_rad"});
}

constexpr OptionTable kWindow{
    Option{"max_keyframes", &WindowOptions::max_keyframes, 3, 100},
    Option{"point_sigma_px", &WindowOptions::point_sigma_px, 0.01, 20.0},
    Option{"max_tracking_chi2", &WindowOptions::max_tracking_chi2, 1.0, 1e6},
    Option{"max_iterations", &WindowOptions::max_iterations, 1, 100},
    Option{"zero_velocity_sigma_m_s", &WindowOptions::zero_velocity_sigma_m_s, 1e-6, 10.0}};

void WindowOptions::Check() const {
  kWindow.Check("window", *this);
  triangulation.Check();
}
void WindowOptions::Read(YamlSection section) {
  triangulation.Read(section.Section("triangulation"));
  kWindow.Read(
      section, this,
      {"point_loss_sigma", "max_point_chi2", "max_tracking_iterations", "first_tilt_sigma_rad",
       "first_velocity_sigma_m_s", "first_gyro_bias_sigma_rad_s", "first_accel_bias_sigma_m_s2"});
}

constexpr OptionTable kKeyframe{
    Option{"min_parallax_px", &KeyframeOptions::min_parallax_px, 0.1, 1000.0},
    Option{"min_kept_share", &KeyframeOptions::min_kept_share, 0.0, 1.0},
    Option{"max_interval_s", &KeyframeOptions::max_interval_s, 0.01, 100.0}};

void KeyframeOptions::Check() const { kKeyframe.Check("keyframes", *this); }
void KeyframeOptions::Read(YamlSection section) {
  kKeyframe.Read(
      section, this,
      {"sparse_share", "sparse_interval_s", "still_parallax_px", "max_still_rate_rad_s"});
}

constexpr OptionTable kInitializer{
    Option{"min_points", &InitializerOptions::min_points, 5, 10000},
    Option{"max_reprojection_sigma", &InitializerOptions::max_reprojection_sigma, 0.5, 100.0}};

void InitializerOptions::Check() const { kInitializer.Check("initializer", *this); }
void InitializerOptions::Read(YamlSection section) {
  kInitializer.Read(section, this,
                    {"window_s", "max_still_flow_px", "max_still_accel_sigma_m_s2",
                     "max_still_gyro_sigma_rad_s", "max_gravity_error_m_s2"});
}

constexpr OptionTable kFailure{Option{"min_points", &FailureOptions::min_points, 1, 1000},
                               Option{"max_lost_s", &FailureOptions::max_lost_s, 0.05, 1000.0},
                               Option{"max_speed_m_s", &FailureOptions::max_speed_m_s, 0.1, 1e4}};

void FailureOptions::Check() const { kFailure.Check("failure", *this); }
void FailureOptions::Read(YamlSection section) {
  kFailure.Read(section, this, {"max_gyro_bias_rad_s", "max_accel_bias_m_s2", "max_imu_gap_s"});
}

constexpr OptionTable kLineTriangulation{
    Option{"min_distance_m", &LineTriangulationOptions::min_distance_m, 0.0, 100.0},
    Option{"max_distance_m", &LineTriangulationOptions::max_distance_m, 0.1, 1e5},
    Option{"loss_sigma", &LineTriangulationOptions::loss_sigma, 0.1, 1e3}};

void LineTriangulationOptions::Check() const {
  kLineTriangulation.Check("line_landmarks.triangulation", *this);
  CheckOrder("line_landmarks.triangulation", "min_distance_m", min_distance_m, "max_distance_m",
             max_distance_m);
}
void LineTriangulationOptions::Read(YamlSection section) {
  kLineTriangulation.Read(section, this, {"max_relative_sigma", "max_direction_sigma_rad"});
}

constexpr OptionTable kLineLandmark{
    Option{"sigma_px", &LineLandmarkOptions::sigma_px, 0.01, 20.0},
    Option{"loss_sigma", &LineLandmarkOptions::loss_sigma, 0.1, 100.0},
    Option{"max_chi2", &LineLandmarkOptions::max_chi2, 1.0, 1e6},
    Option{"max_tracking_chi2", &LineLandmarkOptions::max_tracking_chi2, 1.0, 1e9},
    Option{"max_median_chi2", &LineLandmarkOptions::max_median_chi2, 0.1, 1e6},
    Option{"max_new_chi2", &LineLandmarkOptions::max_new_chi2, 1.0, 1e6},
    Option{"anchor_at_origin", &LineLandmarkOptions::anchor_at_origin, false, true},
    Option{"point_sigma_m", &LineLandmarkOptions::point_sigma_m, 1e-4, 10.0},
    Option{"max_member_sigma_m", &LineLandmarkOptions::max_member_sigma_m, 1e-4, 100.0}};

void LineLandmarkOptions::Check() const {
  kLineLandmark.Check("line_landmarks", *this);
  triangulation.Check();
}
void LineLandmarkOptions::Read(YamlSection section) {
  triangulation.Read(section.Section("triangulation"));
  kLineLandmark.Read(
      section, this,
      {"min_keyframes", "min_general_keyframes", "general_above_rad", "merge_sigmas",
       "min_merge_distance_m", "max_merge_distance_m", "max_apart_sigmas", "max_unseen"});
}

}  // namespace slcmap::odometry
