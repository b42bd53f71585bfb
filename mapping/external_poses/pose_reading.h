// Which reading of poses by others agrees with how the rig is known to have moved.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/io/pose_file.h"
#include "mapping/external_poses/image_steps.h"

namespace slcmap::inline mapping {

struct PoseReading {
  bool is_judged = false;  // enough steps have poses, by some reading
  bool agrees = true;      // as they were read, as far as can be told
  PoseForm form;           // the reading that agrees, where `agrees` is false and there is one
  bool is_explained = false;
  std::string words;   // what is wrong, and by which figures; "" where they agree
  std::string change;  // what is wrong of a part of poses that agree otherwise; "" where nothing is
  PoseOff given, best;
  double moved_rad = 0, moved_m = 0;  // of the steps, medians
};

// Tries orders of the quaternion, its conjugate, poses of IMU and camera and their inverses,
// offsets of the clock, and the scale. `steps` are known movements of the IMU: those of images, or
// of true poses. `who` is what they are by, for the words.
PoseReading ClassifyReading(const PoseTable& table, const PoseForm& given,
                            const std::vector<BodyStep>& steps,
                            const std::optional<RigidTransform>& T_imu_camera,
                            const std::string& who);

}  // namespace slcmap::mapping
