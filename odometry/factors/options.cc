#include "odometry/factors/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kCalibration{
    Option{"time_offset", &CalibrationOptions::time_offset, false, true},
    Option{"imu_rotation", &CalibrationOptions::imu_rotation, false, true},
    Option{"lever", &CalibrationOptions::lever, false, true},
    Option{"imu_scale", &CalibrationOptions::imu_scale, false, true},
    Option{"imu_axes", &CalibrationOptions::imu_axes, false, true},
    Option{"right_rotation", &CalibrationOptions::right_rotation, false, true},
    Option{"focal_length", &CalibrationOptions::focal_length, false, true},
    Option{"right_centre", &CalibrationOptions::right_centre, false, true},
    Option{"readout", &CalibrationOptions::readout, false, true},
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
    Option{"readout_sigma_s", &CalibrationOptions::readout_sigma_s, 1e-6, 0.1},
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
  kCalibration.Read(section, this, {"principal_points"});
}

}  // namespace slcmap::odometry
