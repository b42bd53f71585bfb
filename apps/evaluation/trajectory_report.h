// Trajectory metrics as JSON, and why an estimate may be of another form.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/evaluation/trajectory_metrics.h"
#include "data/io/pose_file.h"
#include "data/io/trajectory.h"
#include "mapping/external_poses/image_steps.h"

namespace slcmap::inline evaluation {

// What is wrong with the estimate as it was read (its quaternions, its body, its inverse, the
// scale, its clock, its up), by the movements of the truth, and the options that take it; nothing
// where both agree, or too little tells. Where the camera is on the IMU is asked for only where the
// estimate does not agree without it; it may be none.
std::optional<std::string> FindOtherForm(
    const PoseTable& estimate, const PoseForm& form, const Trajectory& truth,
    const std::function<std::optional<RigidTransform>()>& camera);

// Movements of a trajectory at the stamps of another, where these have poses, else at its own.
std::vector<BodyStep> CollectSteps(const Trajectory& truth, const Trajectory& estimate);

// Where the left camera is on the IMU, by the calibration that is named, or that of the recording
// that a file of true poses lies beside or in; nothing where there is none.
std::optional<RigidTransform> FindCameraPose(const std::string& calibration,
                                             const std::string& truth);

// What was compared.
struct EvaluationInputs {
  std::string truth, estimate;  // paths
  PoseForm form;                // of the estimate, or of the truth
  std::string form_of = "estimate";
  std::string calibration;  // where the camera is on the IMU; "": beside the truth
  std::string finding;      // what of the forms of both does not agree, and the remedy; else ""
  std::string stamps;       // path of the stamps that coverage counts; empty: those of the truth
};

nlohmann::ordered_json TrajectoryJson(const EvaluationInputs& inputs,
                                      const TrajectoryMetrics& metrics);

}  // namespace slcmap::evaluation
