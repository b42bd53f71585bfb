// Errors of a trajectory against the true one, and the alignment of both.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/rigid_transform.h"
#include "data/io/pose_file.h"
#include "data/io/trajectory.h"
#include "mapping/external_poses/image_steps.h"
#include "odometry/run/run.h"

namespace slcmap::inline evaluation {

// What an alignment may change. A visual-inertial estimator observes all but position and yaw, so
// kPositionYaw is the fair one; kRigid is what most other tools do; kSimilarity also scales, which
// is for methods that cannot know the scale.
enum class AlignmentKind { kPositionYaw, kRigid, kSimilarity };

std::string AlignmentName(AlignmentKind kind);  // "posyaw", "se3", "sim3"

// p_truth = scale * rotation * p_estimate + translation.
struct Alignment {
  double scale = 1;
  RigidTransform T_truth_estimate;

  Eigen::Vector3d Position(const Eigen::Vector3d& p_estimate) const {
    return T_truth_estimate.rotation * (scale * p_estimate) + T_truth_estimate.translation;
  }
};

// The alignment of least squares between the columns of two equally large matrices (metres). kRigid
// and kSimilarity follow S. Umeyama, "Least-squares estimation of transformation parameters between
// two point patterns", PAMI 1991; the yaw of kPositionYaw has a closed form. Positions that do not
// determine the rotation (less than three, or all on a line) get some rotation of least squares.
Alignment Align(AlignmentKind kind, const Eigen::Matrix3Xd& estimate,
                const Eigen::Matrix3Xd& truth);

// How far an estimated trajectory is from the truth.

inline constexpr double kMaxTruthGap_s = 0.1;

// Statistics of a set of errors, in their unit.
struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
};
ErrorStatistics Statistics(std::vector<double> errors);  // of at least one error

// Absolute pose error after an alignment.
struct AbsoluteError {
  AlignmentKind kind = AlignmentKind::kPositionYaw;
  Alignment alignment;
  ErrorStatistics position_m;
  ErrorStatistics rotation_deg;
  double rmse_percent = 0;  // position RMSE over the true path length; kNoFigure at rest
  std::vector<double> position_errors_m;  // a value for each associated pose
  std::vector<double> rotation_errors_deg;
};

// Relative pose error over pieces of a given length of the true path, one starting at each pose.
struct RelativeError {
  double length_m = 0;
  int64_t pieces = 0;  // none where the path is shorter: the others are kNoFigure
  double translation_rmse_percent = 0;
  double translation_median_percent = 0;
  double rotation_rmse_deg = 0;
  double rotation_rmse_deg_m = 0;
};

// The error of the motion from first to last pose where the true path ends at its start.
struct LoopError {
  double distance_m = 0;
  double percent = 0;  // of the true path length
};

// Shares of the reference stamps (images, or truth) that have a pose near them (0.6 frames).
struct Coverage {
  double overall = 0;
  double after_initialisation = 0;
  bool flagged = false;  // too low for the errors to be compared
};

// An estimated pose with the truth at its stamp.
struct AssociatedPose {
  int64_t stamp_ns = 0;
  RigidTransform T_world_estimate;  // in the estimator's world
  RigidTransform T_world_truth;
};

struct TrajectoryMetrics {
  std::vector<AssociatedPose> poses;
  int64_t estimated_poses = 0;
  int pieces = 0;             // runs of poses without a gap of more than three frames
  double truth_length_m = 0;  // along the associated poses
  double estimate_length_m = 0;
  std::vector<AbsoluteError> absolute;  // posyaw, se3, sim3
  std::vector<RelativeError> relative;
  std::optional<LoopError> loop;
  // Of the last pose about the vertical, with the trajectories turned to agree at the first one; in
  // (-180, 180], positive where the estimate has turned too far to the left.
  double heading_error_deg = 0;
  Coverage coverage;
};

// The poses of a run's states, as they were known at once.
Trajectory OnlinePoses(const std::vector<OnlineState>& states);

// From pose to pose.
double MeasurePathLength_m(const Trajectory& trajectory);

// Compares by stamp, with the truth interpolated. `reference_stamps_ns` (sorted) are the stamps
// that should have a pose, such as those of the images; where empty, those of the truth. Throws
// DataError when less than three poses have a truth, or when both are at rest: within 1 cm.
TrajectoryMetrics EvaluateTrajectory(const Trajectory& truth, const Trajectory& estimate,
                                     const std::vector<int64_t>& reference_stamps_ns,
                                     double max_truth_gap_s = kMaxTruthGap_s);

// Trajectory metrics as JSON, and why an estimate may be of another form.

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
