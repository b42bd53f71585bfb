// What is estimated of the calibration.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

// What is estimated of the rig beside its motion: corrections of the calibration that was given,
// each with the standard deviation of what was given, which is where the estimate starts.
struct CalibrationOptions {
  bool time_offset = true;     // camera to IMU
  bool imu_rotation = true;    // the same
  bool lever = false;          // the same
  bool imu_scale = true;       // of accelerometer and gyroscope
  bool imu_axes = true;        // of the same: off the right angle, and turned against each other
  bool right_rotation = true;  // of the right camera against the left one
  bool focal_length = true;    // of both cameras in common
  bool readout = false;        // of rolling shutters; all cameras have the same
  bool right_centre = true;    // principal point of the right camera, against the left one's
  // Rows of rectified images are believed to fit while they do, and the right camera so to be as it
  // was calibrated: its turns about y and z are then tied to the given ones from the start (see
  // `confirm`), until the motion speaks against it. Where they do not, its turns are never tied:
  // what the check before the start found is off by some thousandths of a degree, which count in a
  // hall.
  bool rows_fit = true;
  // What agrees with the given calibration is taken to be as given while it does; see
  // odometry/factors/calibration_estimate.h.
  bool confirm = true;
  // How much further than the window claims its estimates are off, since what images err in is
  // common to neighbouring ones: 1.1 to 1.5 in exact simulated recordings.
  double sigma_scale = 1.5;
  double time_offset_sigma_s = 0.015;
  double imu_rotation_sigma_rad = 0.01;
  double lever_sigma_m = 0.003;
  double imu_scale_sigma = 0.015;  // relative; 1 to 3 % in phones and other low-cost IMUs
  double imu_axes_sigma_rad = 0.005;
  double right_rotation_sigma_rad = 0.002;
  double focal_length_sigma = 0.002;  // relative
  double right_centre_sigma_px = 2;
  double readout_sigma_s = 0.01;
  // Beyond these an estimate is not believed, and the given value is used.
  double max_time_offset_s = 0.15;
  double max_imu_rotation_rad = 0.09;
  double max_lever_m = 0.1;
  double max_imu_scale = 0.12;  // of the three axes together
  double max_imu_axes_rad = 0.06;
  double max_right_rotation_rad = 0.02;
  double max_focal_length = 0.03;
  double max_right_centre_px =
      5;  // beyond it the linear model of odometry/geometry/pinhole.h is off
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap::odometry
