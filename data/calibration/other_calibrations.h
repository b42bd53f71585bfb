// Calibration files by other programs, told by what is in them.
//
//   ROS          camera_info yaml of camera_calibration, a file a camera (left, then right)
//   ORB-SLAM3    settings with Camera1.fx, Stereo.T_c1_c2 or Stereo.b, IMU.T_b_c1
//   VINS         VINS-Fusion's file with cam0_calib and body_T_cam0, or VINS-Mono's with
//                extrinsicRotation; cameras alone, too (camodocal: PINHOLE, MEI, KANNALA_BRANDT)
//   Basalt       JSON with T_imu_cam and intrinsics
//   OpenCV       M1, D1, M2, D2 and R, T, as stereoCalibrate returns them, with image_width and
//                image_height
//   parts        a Kalibr chain without intrinsics (poses, timeshift_cam_imu) or an IMU's noise
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/calibration/rig_parts.h"

namespace slcmap::inline data {

inline constexpr const char* kRightAtLeft = "right_cameras_at_the_left_by_calibration";  // counted

// A file or folder, or several by commas, as --calibration names them.
std::vector<std::string> SplitCalibrationPaths(const std::string& path);

// Whether these are files for ReadRigParts; "" is none.
bool TellsParts(const std::string& path);

// The name of a file's form as above; nothing of a whole Kalibr chain and of what is none of these.
std::optional<std::string> FindCalibrationForm(const std::string& path);

// What files of these forms say together; cameras without a place of their own are left, then
// right. Noise that VINS has is tuned to it, and is not taken. Throws InputFault naming file and
// key, for files of no such form, and for two files that tell the same.
RigParts ReadRigParts(const std::vector<std::string>& paths, Mirrored mirrored, Warnings* warnings);

}  // namespace slcmap::data
