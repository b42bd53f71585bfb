// What evaluate reads: the trajectories that are compared and what lies beside them, and where its
// results may be written.
#pragma once

#include <string>
#include <vector>

#include "apps/evaluation/trajectory_report.h"
#include "data/core/rigid_transform.h"
#include "data/io/pose_file.h"

namespace slcmap::inline commands {

// The stamps of the images beside a EuRoC ground truth (mav0/*/data.csv); empty where there are
// none.
std::string ImageStampsBeside(const std::string& truth);

// The true poses of the IMU. Throws DataError.
Trajectory ReadTruth(const EvaluationInputs& inputs);

struct ReadEstimate {
  PoseTable table;
  PoseForm form;
  Trajectory poses;
};

// The estimate, whose rows without stamps have those of the images, or of the truth. Throws
// DataError.
ReadEstimate LoadEstimate(const EvaluationInputs& inputs, const Trajectory& truth);

// Compares both, and says in `inputs` what of their forms does not agree. Throws DataError.
TrajectoryMetrics CompareTrajectories(EvaluationInputs* inputs, double max_truth_gap_s);

// How a map's files and a trajectory belong together.

// The world of files that lie in a map or export folder, in that of a trajectory: a map is turned
// along its building, its run is not. Where both are of one run, by the summaries beside them, that
// tells; else it is taken to be the same world, with a warning where the map is turned against its
// run, or a summary cannot be read. Throws ConfigError where files are of different worlds.
RigidTransform TrajectoryFromMap(const std::string& trajectory,
                                 const std::vector<std::string>& mapped_files);

// Where figures of an evaluation may be written.

// Throws ConfigError naming the option where `path`, of a file or a folder, is one of the inputs,
// or is or lies in the folder of a run, a map, an export or a recording: nothing of these is
// overwritten, nor anything added to them. An empty path is none.
void RefuseAsResult(const std::string& option, const std::string& path,
                    const std::vector<std::string>& inputs);

}  // namespace slcmap::commands
