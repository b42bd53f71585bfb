// The trajectories that are compared: what lies beside them, and how their files are read.
#pragma once

#include <string>

#include "apps/evaluation/trajectory_report.h"
#include "data/pose_file.h"

namespace slcmap {

// The stamps of the images beside a EuRoC ground truth (mav0/*/data.csv); empty where there are
// none.
std::string ImageStampsBeside(const std::string& truth);

// What a run folder says of the calibration beside its trajectory; empty where that lies in none.
std::string CalibrationBeside(const std::string& estimate);

// The true poses of the IMU. Throws DataError.
Trajectory ReadTruth(const EvaluationInputs& inputs);

struct ReadEstimate {
  PoseTable table;
  PoseForm form;
  Trajectory poses;
};

// The estimate, whose rows without stamps have those of the images, or of the truth. Throws
// DataError.
ReadEstimate EstimateOf(const EvaluationInputs& inputs, const Trajectory& truth);

// Compares both, and says in `inputs` what of their forms does not agree. Throws DataError.
TrajectoryMetrics CompareTrajectories(EvaluationInputs* inputs,
                                      const TrajectoryMetricOptions& options);

}  // namespace slcmap
