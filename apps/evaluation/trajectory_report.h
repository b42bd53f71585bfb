// Trajectory metrics as text: a table to read and JSON to compute with.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/evaluation/trajectory_metrics.h"
#include "data/pose_form.h"

namespace slcmap {

// What was compared; stands at the head of both forms.
struct EvaluationInputs {
  std::string truth, estimate;  // paths
  PoseForm form;                // of the estimate, or of the truth
  std::string form_of = "estimate";
  std::string calibration;  // where the camera is on the IMU; "": beside the truth
  std::string finding;      // what of the forms of both does not agree, and the remedy; else ""
  std::string stamps;       // path of the stamps that coverage counts; empty: those of the truth
};

std::string TrajectoryTable(const EvaluationInputs& inputs, const TrajectoryMetrics& metrics);
nlohmann::ordered_json TrajectoryJson(const EvaluationInputs& inputs,
                                      const TrajectoryMetrics& metrics);

}  // namespace slcmap
