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

}  // namespace slcmap::odometry
