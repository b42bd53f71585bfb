// Whether an estimate is written in another form than its truth.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "mapping/given_poses/image_steps.h"
#include "data/pose_file.h"

namespace slcmap {

// What is wrong with the estimate as it was read (its quaternions, its body, its inverse, the
// scale, its clock, its up), by the movements of the truth, and the options that take it; nothing
// where both agree, or too little tells. Where the camera is on the IMU is asked for only where the
// estimate does not agree without it; it may be none.
std::optional<std::string> FindOtherForm(
    const PoseTable& estimate, const PoseForm& form, const Trajectory& truth,
    const std::function<std::optional<RigidTransform>()>& camera);

// Movements of a trajectory at the stamps of another, where these have poses, else at its own.
std::vector<BodyStep> StepsOf(const Trajectory& truth, const Trajectory& estimate);

// Where the left camera is on the IMU, by the calibration that is named, or that of the recording
// that a file of true poses lies beside or in; nothing where there is none.
std::optional<RigidTransform> FindCameraPose(const std::string& calibration, const std::string& truth);

}  // namespace slcmap
