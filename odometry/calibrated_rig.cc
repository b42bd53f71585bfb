#include "odometry/calibrated_rig.h"

#include "data/calibration.h"

namespace slcmap {

Rig CalibratedRig(const Rig& given, const Rig& rectified, const CalibrationEstimate& estimate) {
  Rig rig = given;
  const ImuCorrection found = CorrectionOf(estimate.imu_errors);
  rig.imu_correction = {found.accel * given.imu_correction.accel,
                        found.gyro * given.imu_correction.gyro};
  rig.camera_time_offset_s += estimate.time_offset_s;
  if (IsStereo(given)) {
    // The raw right camera turns with the rectified one.
    const Eigen::Quaterniond& R_imu_rectified = rectified.T_imu_camera[1].rotation;
    rig.cameras[1].cx_px += estimate.right_centre_px.x();
    rig.cameras[1].cy_px += estimate.right_centre_px.y();
    rig.T_imu_camera[1].rotation = R_imu_rectified * ExpRotation(estimate.right_rotation_rad) *
                                   R_imu_rectified.conjugate() * given.T_imu_camera[1].rotation;
  }
  const RigidTransform T_given_imu(ExpRotation(estimate.imu_rotation_rad), estimate.lever_m);
  for (int i = 0; i < 2; ++i) {
    rig.T_imu_camera[i] = T_given_imu.Inverse() * rig.T_imu_camera[i];
    rig.cameras[i].fx_px *= 1 + estimate.focal_length;
    rig.cameras[i].fy_px *= 1 + estimate.focal_length;
  }
  return rig;
}

}  // namespace slcmap
