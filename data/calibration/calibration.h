// Calibrations of a stereo camera with an IMU, from ASL and Kalibr files.
#pragma once

#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"

namespace slcmap::inline data {

struct Calibration {
  Rig rig;
  std::string source;         // the files and the transforms read from them, for the user to see
  std::vector<int> cameras;   // that the rig is of: 0 and 1 of "cam0", "cam1", in the rig's order
  std::string without_noise;  // the file that lacks the IMU's noise: a typical one is taken
};

// Reads cam0/sensor.yaml, cam1/sensor.yaml (where there is a cam1) and imu0/sensor.yaml under an
// ASL folder (mav0). T_BS maps sensor to body. Cameras may hold Kalibr's timeshift_cam_imu and
// readout_s (Rig::readout_s) besides ASL's keys, the IMU what ReadImuCorrection takes.
Calibration ReadAslCalibration(const std::string& folder, Warnings* warnings,
                               Mirrored mirrored = Mirrored::kRefused,
                               const std::vector<int>& cameras = {});

// Reads a Kalibr camera chain: cam0 and any others, each with T_cam_imu (imu to camera) or
// T_imu_cam (camera to imu), or with T_cn_cnm1 (from the camera before) if it has neither. imu_path
// is Kalibr's or OpenVINS' IMU file (its keys at the top or under imu0), with what
// ReadImuCorrection takes, T_i_b (imu0, whose pose the cameras tell, to this IMU) and time_offset
// (stamp of imu0 = stamp of this IMU + offset): the rig is brought to the frame and clock of this
// IMU's samples. "" assumes a typical noise, see without_noise.
Calibration ReadKalibrCalibration(const std::string& camchain_path, const std::string& imu_path,
                                  Warnings* warnings, Mirrored mirrored = Mirrored::kRefused,
                                  const std::vector<int>& cameras = {});

// Finds the calibration of a sequence whose ASL folder is given: sensor.yaml of its sensors, else a
// Kalibr chain and IMU file in it, in the folder above, or in dso/ there (TUM VI).
Calibration FindCalibration(const std::string& asl_folder, Warnings* warnings,
                            Mirrored mirrored = Mirrored::kRefused,
                            const std::vector<int>& cameras = {});

// Writes a rig as a Kalibr camera chain, with T_cam_imu (IMU to camera) and timeshift_cam_imu
// (t_imu = t_cam + shift) of each camera, and with Kalibr's keys of the IMU under imu0, its
// correction as scale-misalignment, so that ReadCalibration() takes the file alone. Throws
// OutputError.
void WriteKalibrCalibration(const std::string& path, const Rig& rig);

// Reads what --calibration names: a Kalibr chain (with imu0 in it, an IMU file beside it, if there
// is one, or one named behind a comma), a folder that FindCalibration understands, or a file of
// another program, or several by commas (data/calibration/other_calibrations.h).
Calibration ReadCalibration(const std::string& path, Warnings* warnings,
                            Mirrored mirrored = Mirrored::kRefused,
                            const std::vector<int>& cameras = {});

// `cameras` are those that the rig is to be of; without, all (ChooseCameras() in
// data/calibration/camera_words.h). The time shift is that of the first. Where another's is at most
// 1 ms off, both are taken to be triggered together, with a warning; where it is at most
// kMaxRightOffset_s off, that is Rig::right_time_offset_s; beyond is an error.
//
// Keys that the formats define and that nothing needs (rostopic, cam_overlaps, comment) are passed
// over; any other is an error.
//
// All of them throw DataError (an InputFault wherever a remedy is known) naming file and key, what
// was found and what is expected, when an entry is missing or absurd; CheckRig is what they use for
// the rig as a whole.
void CheckRig(const Rig& rig, const std::string& place);

}  // namespace slcmap::data
