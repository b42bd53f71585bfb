#include "odometry/window/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

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
