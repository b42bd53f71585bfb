// A rig of parts: files and bags that each tell a part of its calibration.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/core/types.h"

namespace slcmap::inline data {

// What is known so far, by camera, of two at least. Index 0 is the left camera, 1 the right one.
struct RigParts {
  std::vector<std::optional<Camera>> cameras = std::vector<std::optional<Camera>>(2);
  std::vector<std::optional<RigidTransform>> T_imu_camera =
      std::vector<std::optional<RigidTransform>>(2);
  std::optional<RigidTransform> T_left_right;
  std::vector<std::optional<double>> readout_s = std::vector<std::optional<double>>(2);
  std::optional<double> camera_time_offset_s;  // as Rig has it
  std::optional<ImuNoise> imu_noise;
  std::optional<ImuCorrection> imu_correction;
  bool has_right = true;           // a right camera is expected
  std::vector<std::string> found;  // what told which, in words

  // For so many cameras at least.
  void Reserve(size_t count) {
    if (count <= cameras.size()) return;
    cameras.resize(count);
    T_imu_camera.resize(count);
    readout_s.resize(count);
  }
};

// Adds what `parts` lack and the others have.
void AddParts(const RigParts& others, RigParts* parts);

// Whether all cameras and poses are known.
bool IsWhole(const RigParts& parts);

// The whole rig, or the `cameras` of it; without noise, a typical one is taken
// (Calibration::without_noise is then `place`), and without an offset none. Throws one InputFault
// where cameras or poses are missing: what was found, all that is missing, and how to say it; and
// what CheckRig throws, and for cameras that there are not.
Calibration MakeCalibration(const RigParts& parts, const std::string& place,
                            const std::vector<int>& cameras = {});

}  // namespace slcmap::data
