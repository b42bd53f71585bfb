// The calibration that a recording in a bag brings with it.
#pragma once

#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {

// What the reader of a bag counts.
inline constexpr const char* kCamerasSwapped = "right_cameras_at_the_left_by_camera_info";
inline constexpr const char* kBaselinesDiffer = "right_cameras_elsewhere_by_tf";
inline constexpr const char* kCamerasNotCalibrated = "cameras_left_out_without_calibration";
inline constexpr const char* kImuPoseIsZero = "imu_poses_of_zeros";

// The rig of these topics, or those `cameras` of it, by camera_info (of raw images and
// rectified ones), tf_static and tf, the transforms of RealSense Viewer, and what the rig's profile
// knows (time offset, noise).
//
// `beside` is what --calibration names, "" of nothing: a whole calibration is taken as it is, and
// what only tells a part (data/calibration/other_calibrations.h) goes before
// what the bag has. What neither tells is one InputFault, as MakeCalibration throws it; of cameras
// beyond the first two that neither tells of, a warning. A right
// camera that stands at the left by its camera_info is counted, as are baselines by tf that are
// others, and a pose of the IMU that is all zeros.
Calibration ReadBagCalibration(const RecordingTopics& topics, const std::string& beside, Bag* bag,
                               Warnings* warnings, Mirrored mirrored = Mirrored::kRefused,
                               const std::vector<int>& cameras = {});

}  // namespace slcmap::data
