#include "apps/evaluation/trajectory_metrics.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/evaluation/report.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "mapping/external_poses/pose_reading.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kInitialisation_s = 1;  // of a sequence; what may go without a pose
constexpr double kMinCoverage = 0.99;    // after initialisation; below it, a result is flagged
constexpr double kMaxLoopGap = 0.05;     // of the path: the truth ends this near to its start

// Minimises sum |truth - Rz(yaw) estimate - t|^2: with both sets centred, the sum falls with
// cos(yaw) * sum(xe xt + ye yt) + sin(yaw) * sum(xe yt - ye xt).
Alignment AlignPositionYaw(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth) {
  const Eigen::Vector3d mean_estimate = estimate.rowwise().mean(),
                        mean_truth = truth.rowwise().mean();
  const Eigen::Matrix3Xd e = estimate.colwise() - mean_estimate, t = truth.colwise() - mean_truth;
  const double along = e.row(0).dot(t.row(0)) + e.row(1).dot(t.row(1));
  const double across = e.row(0).dot(t.row(1)) - e.row(1).dot(t.row(0));
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(std::atan2(across, along), Eigen::Vector3d::UnitZ()));
  return {1, {rotation, mean_truth - rotation * mean_estimate}};
}

Alignment AlignUmeyama(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth,
                       bool with_scale) {
  // Without any extent there is no scale to find.
  with_scale = with_scale && (estimate.colwise() - estimate.col(0)).norm() > 1e-9;
  const Eigen::Matrix4d matrix = Eigen::umeyama(estimate, truth, with_scale);
  const double scale = with_scale ? std::cbrt(matrix.topLeftCorner<3, 3>().determinant()) : 1;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>() / scale;
  return {scale, {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()}};
}

}  // namespace

std::string AlignmentName(AlignmentKind kind) {
  return std::array{"posyaw", "se3", "sim3"}[static_cast<std::size_t>(kind)];
}

Alignment Align(AlignmentKind kind, const Eigen::Matrix3Xd& estimate,
                const Eigen::Matrix3Xd& truth) {
  if (kind == AlignmentKind::kPositionYaw) return AlignPositionYaw(estimate, truth);
  return AlignUmeyama(estimate, truth, kind == AlignmentKind::kSimilarity);
}

namespace {

constexpr double kMaxGapFrames = 3;
constexpr double kMinExtent_m = 0.01;
// A pose stands for the stamps around it; a little more than half a frame, as stamps jitter.
constexpr double kCoveredFrames = 0.6;

double RootMeanSquare(const std::vector<double>& values) {
  const double sum = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double ComputeMiddle(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

double AngleDeg(const Eigen::Quaterniond& rotation) {
  return LogRotation(rotation).norm() * kDegreesPerRadian;
}

std::vector<AssociatedPose> Associate(const Trajectory& truth, const Trajectory& estimate,
                                      double max_gap_s) {
  std::vector<AssociatedPose> poses;
  for (const StampedPose& pose : estimate) {
    const auto T_world_truth = PoseAt(truth, pose.stamp_ns, max_gap_s);
    if (T_world_truth) poses.push_back({pose.stamp_ns, pose.T_world_imu, *T_world_truth});
  }
  return poses;
}

// The median time between poses; 0 for a single one.
int64_t FramePeriod(const Trajectory& estimate) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    periods.push_back(static_cast<double>(estimate[i].stamp_ns - estimate[i - 1].stamp_ns));
  }
  return periods.empty() ? 0 : static_cast<int64_t>(ComputeMiddle(periods));
}

int CountPieces(const Trajectory& estimate, int64_t period_ns) {
  int pieces = estimate.empty() ? 0 : 1;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const auto gap_ns = static_cast<double>(estimate[i].stamp_ns - estimate[i - 1].stamp_ns);
    if (gap_ns > kMaxGapFrames * static_cast<double>(period_ns)) ++pieces;
  }
  return pieces;
}

bool HasPoseWithin(const Trajectory& estimate, int64_t stamp_ns, int64_t tolerance_ns) {
  const auto next = std::lower_bound(
      estimate.begin(), estimate.end(), stamp_ns - tolerance_ns,
      [](const StampedPose& pose, int64_t stamp) { return pose.stamp_ns < stamp; });
  return next != estimate.end() && next->stamp_ns <= stamp_ns + tolerance_ns;
}

Coverage MeasureCoverage(const std::vector<int64_t>& reference_stamps_ns,
                         const Trajectory& estimate, int64_t period_ns) {
  const auto tolerance_ns = static_cast<int64_t>(kCoveredFrames * static_cast<double>(period_ns));
  const int64_t initialised_ns = reference_stamps_ns.front() + ToNanoseconds(kInitialisation_s);
  int64_t covered = 0, later = 0, later_covered = 0;
  for (const int64_t stamp_ns : reference_stamps_ns) {
    const bool has_pose = HasPoseWithin(estimate, stamp_ns, tolerance_ns);
    covered += has_pose;
    if (stamp_ns < initialised_ns) continue;
    ++later;
    later_covered += has_pose;
  }
  Coverage coverage;
  coverage.overall = static_cast<double>(covered) / static_cast<double>(reference_stamps_ns.size());
  coverage.after_initialisation =
      later == 0 ? coverage.overall
                 : static_cast<double>(later_covered) / static_cast<double>(later);
  coverage.flagged = coverage.after_initialisation < kMinCoverage;
  return coverage;
}

// Travelled length up to each pose, of the truth.
std::vector<double> TruthLengths(const std::vector<AssociatedPose>& poses) {
  std::vector<double> lengths_m(poses.size(), 0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    lengths_m[i] =
        lengths_m[i - 1] +
        (poses[i].T_world_truth.translation - poses[i - 1].T_world_truth.translation).norm();
  }
  return lengths_m;
}

// The largest distance of a pose from the first one, of truth or estimate.
double ExtentOfPath(const std::vector<AssociatedPose>& poses) {
  double extent_m = 0;
  for (const AssociatedPose& pose : poses) {
    for (const auto member : {&AssociatedPose::T_world_truth, &AssociatedPose::T_world_estimate}) {
      const double distance_m =
          ((pose.*member).translation - (poses.front().*member).translation).norm();
      extent_m = std::max(extent_m, distance_m);
    }
  }
  return extent_m;
}

AbsoluteError MeasureAbsolute(AlignmentKind kind, const std::vector<AssociatedPose>& poses,
                              double length_m) {
  Eigen::Matrix3Xd estimate(3, poses.size()), truth(3, poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    estimate.col(static_cast<Eigen::Index>(i)) = poses[i].T_world_estimate.translation;
    truth.col(static_cast<Eigen::Index>(i)) = poses[i].T_world_truth.translation;
  }
  AbsoluteError error;
  error.kind = kind;
  error.alignment = Align(kind, estimate, truth);
  const Eigen::Quaterniond& R_truth_estimate = error.alignment.T_truth_estimate.rotation;
  for (const AssociatedPose& pose : poses) {
    const Eigen::Vector3d p = error.alignment.Position(pose.T_world_estimate.translation);
    error.position_errors_m.push_back((p - pose.T_world_truth.translation).norm());
    error.rotation_errors_deg.push_back(
        AngleDeg(pose.T_world_truth.rotation.conjugate() * R_truth_estimate *
                 pose.T_world_estimate.rotation));
  }
  error.position_m = Statistics(error.position_errors_m);
  error.rotation_deg = Statistics(error.rotation_errors_deg);
  error.rmse_percent = 100 * ComputeShare(error.position_m.rmse, length_m);
  return error;
}

// T_truth^-1 T_estimate of the motion between two poses.
RigidTransform MotionError(const AssociatedPose& from, const AssociatedPose& to) {
  const RigidTransform truth = from.T_world_truth.Inverse() * to.T_world_truth;
  const RigidTransform estimate = from.T_world_estimate.Inverse() * to.T_world_estimate;
  return truth.Inverse() * estimate;
}

RelativeError MeasureRelative(const std::vector<AssociatedPose>& poses,
                              const std::vector<double>& lengths_m, double length_m) {
  std::vector<double> percent, degrees, degrees_per_m;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto end = std::lower_bound(lengths_m.begin(), lengths_m.end(), lengths_m[i] + length_m);
    if (end == lengths_m.end()) break;
    const double travelled_m = *end - lengths_m[i];
    const RigidTransform error =
        MotionError(poses[i], poses[static_cast<std::size_t>(end - lengths_m.begin())]);
    percent.push_back(100 * error.translation.norm() / travelled_m);
    degrees.push_back(AngleDeg(error.rotation));
    degrees_per_m.push_back(degrees.back() / travelled_m);
  }
  if (percent.empty()) return {length_m, 0, kNoFigure, kNoFigure, kNoFigure, kNoFigure};
  return {length_m,
          static_cast<int64_t>(percent.size()),
          RootMeanSquare(percent),
          ComputeMiddle(percent),
          RootMeanSquare(degrees),
          RootMeanSquare(degrees_per_m)};
}

std::optional<LoopError> MeasureLoop(const std::vector<AssociatedPose>& poses, double length_m,
                                     double max_gap) {
  const AssociatedPose &first = poses.front(), &last = poses.back();
  const double gap_m = (last.T_world_truth.translation - first.T_world_truth.translation).norm();
  if (length_m <= 0 || gap_m > max_gap * length_m) return std::nullopt;
  const double distance_m = MotionError(first, last).translation.norm();
  return LoopError{distance_m, 100 * distance_m / length_m};
}

// By how much the estimate's heading is more than the truth's. The rotation between the two worlds
// is nearly one about the vertical; its yaw is the angle of the nearest such rotation.
double HeadingDifference(const AssociatedPose& pose) {
  const Eigen::Matrix3d R =
      (pose.T_world_estimate.rotation * pose.T_world_truth.rotation.conjugate()).toRotationMatrix();
  return std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
}

double MeasureHeading(const std::vector<AssociatedPose>& poses) {
  const double difference_rad = HeadingDifference(poses.back()) - HeadingDifference(poses.front());
  return std::remainder(difference_rad, 2 * M_PI) * kDegreesPerRadian;
}

}  // namespace

ErrorStatistics Statistics(std::vector<double> errors) {
  ErrorStatistics statistics;
  statistics.rmse = RootMeanSquare(errors);
  statistics.mean =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  statistics.max = *std::max_element(errors.begin(), errors.end());
  statistics.median = ComputeMiddle(std::move(errors));
  return statistics;
}

Trajectory OnlinePoses(const std::vector<OnlineState>& states) {
  Trajectory trajectory;
  for (const OnlineState& state : states) {
    trajectory.push_back({state.stamp_ns, state.T_world_imu});
  }
  return trajectory;
}

double MeasurePathLength_m(const Trajectory& trajectory) {
  double length_m = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length_m +=
        (trajectory[i].T_world_imu.translation - trajectory[i - 1].T_world_imu.translation).norm();
  }
  return length_m;
}

TrajectoryMetrics EvaluateTrajectory(const Trajectory& truth, const Trajectory& estimate,
                                     const std::vector<int64_t>& reference_stamps_ns,
                                     double max_truth_gap_s) {
  if (!(max_truth_gap_s > 0)) {
    throw ConfigError(
        fmt::format("--max-truth-gap: found {}, expected more than 0 s", max_truth_gap_s));
  }
  TrajectoryMetrics metrics;
  metrics.poses = Associate(truth, estimate, max_truth_gap_s);
  if (metrics.poses.size() < 3) {
    throw DataError(
        fmt::format("found {} of {} estimated poses with a truth at their stamp, expected "
                    "at least 3: are both files of the same recording and clock?",
                    metrics.poses.size(), estimate.size()));
  }
  if (const double extent_m = ExtentOfPath(metrics.poses); extent_m < kMinExtent_m) {
    throw DataError(
        fmt::format("found {} poses within {:.3g} m of each other, expected a path of at least {} "
                    "m: at rest nothing can be aligned, and no error be measured",
                    metrics.poses.size(), extent_m, kMinExtent_m));
  }
  const int64_t period_ns = FramePeriod(estimate);
  metrics.estimated_poses = static_cast<int64_t>(estimate.size());
  metrics.pieces = CountPieces(estimate, period_ns);

  std::vector<int64_t> stamps_ns = reference_stamps_ns;
  if (stamps_ns.empty()) {
    for (const StampedPose& pose : truth) stamps_ns.push_back(pose.stamp_ns);
  }
  metrics.coverage = MeasureCoverage(stamps_ns, estimate, period_ns);

  const std::vector<double> lengths_m = TruthLengths(metrics.poses);
  metrics.truth_length_m = lengths_m.back();
  metrics.estimate_length_m = MeasurePathLength_m(estimate);
  for (const AlignmentKind kind :
       {AlignmentKind::kPositionYaw, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
    metrics.absolute.push_back(MeasureAbsolute(kind, metrics.poses, metrics.truth_length_m));
  }
  for (const double length_m : {1.0, 5.0, 10.0}) {
    metrics.relative.push_back(MeasureRelative(metrics.poses, lengths_m, length_m));
  }
  metrics.loop = MeasureLoop(metrics.poses, metrics.truth_length_m, kMaxLoopGap);
  metrics.heading_error_deg = MeasureHeading(metrics.poses);
  return metrics;
}

namespace {

namespace fs = std::filesystem;

// Where the truth's up is in the estimate's world, by the turns between both worlds; nothing where
// these differ from pose to pose.
std::optional<Eigen::Vector3d> UpByTruth(const Trajectory& estimate, const Trajectory& truth) {
  constexpr double kMostSpread_rad = 0.1;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Quaterniond> turns;
  for (const StampedPose& pose : estimate) {
    const auto there = PoseAt(truth, pose.stamp_ns, kMaxTruthGap_s);
    if (!there) continue;
    turns.push_back(pose.T_world_imu.rotation * there->rotation.conjugate());
    sum += turns.back().toRotationMatrix();
  }
  if (turns.size() < 3) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R =
      svd.matrixU() *
      Eigen::Vector3d(1, 1, (svd.matrixU() * svd.matrixV()).determinant()).asDiagonal() *
      svd.matrixV().transpose();
  std::vector<double> off_rad;
  for (const Eigen::Quaterniond& turn : turns) {
    off_rad.push_back(turn.angularDistance(Eigen::Quaterniond(R)));
  }
  if (Quantile(off_rad, 0.5) > kMostSpread_rad) return std::nullopt;
  return R.col(2);
}

std::optional<RigidTransform> CameraIn(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(fs::path(folder) / "cam0", error)) return std::nullopt;
  try {
    Warnings warnings;
    return FindCalibration(folder, &warnings).rig.T_imu_camera[0];
  } catch (const DataError&) {
    return std::nullopt;
  }
}

}  // namespace

std::vector<BodyStep> CollectSteps(const Trajectory& truth, const Trajectory& estimate) {
  constexpr size_t kMostSteps = 60;
  Trajectory known;
  for (const StampedPose& pose : estimate) {
    const auto there = PoseAt(truth, pose.stamp_ns, kMaxTruthGap_s);
    if (there) known.push_back({pose.stamp_ns, *there});
  }
  if (2 * known.size() < estimate.size() || known.size() < 3) known = truth;
  std::vector<double> periods_s;
  for (size_t i = 1; i < known.size(); ++i) {
    periods_s.push_back(ToSeconds(known[i].stamp_ns - known[i - 1].stamp_ns));
  }
  const double spacing_s = std::max(kStepOfPoses_s, Quantile(periods_s, 0.5));
  std::vector<BodyStep> steps;
  for (size_t first = 0, second = 0; first < known.size(); ++first) {
    const auto apart_s = [&] { return ToSeconds(known[second].stamp_ns - known[first].stamp_ns); };
    while (second < known.size() && apart_s() < 0.98 * spacing_s) ++second;
    if (second == known.size()) break;
    if (apart_s() > kMostStepsApart * spacing_s) continue;
    steps.push_back({known[first].stamp_ns, known[second].stamp_ns,
                     known[first].T_world_imu.Inverse() * known[second].T_world_imu});
  }
  if (steps.size() <= kMostSteps) return steps;
  std::vector<BodyStep> chosen;
  for (size_t i = 0; i < kMostSteps; ++i) {
    chosen.push_back(steps[i * (steps.size() - 1) / (kMostSteps - 1)]);
  }
  return chosen;
}

std::optional<std::string> FindOtherForm(
    const PoseTable& estimate, const PoseForm& form, const Trajectory& truth,
    const std::function<std::optional<RigidTransform>()>& camera) {
  constexpr double kMostTilt_rad = 5 * M_PI / 180;
  const bool never_turns = std::ranges::all_of(truth, [&](const StampedPose& pose) {
    return pose.T_world_imu.rotation.angularDistance(truth.front().T_world_imu.rotation) < 1e-6;
  });
  if (never_turns) return std::nullopt;  // positions alone, as of a total station
  std::optional<RigidTransform> T_imu_camera;
  if (form.IsOfCamera()) T_imu_camera = camera();
  const Trajectory poses = CollectPoses(estimate, form, T_imu_camera);
  const std::vector<BodyStep> steps = CollectSteps(truth, poses);
  const char* const who = "steps of the truth";
  PoseReading reading = ClassifyReading(estimate, form, steps, T_imu_camera, who);
  if (!reading.agrees && !T_imu_camera) {
    T_imu_camera = camera();
    if (T_imu_camera) reading = ClassifyReading(estimate, form, steps, T_imu_camera, who);
  }
  if (!reading.agrees) {
    const std::string remedy = reading.is_explained ? "give " + FormatOptions(reading.form)
                               : T_imu_camera
                                   ? "expected poses of the same body and recording"
                                   : "--calibration names that of the rig, for poses of its camera";
    return reading.words + "; " + remedy;
  }
  const auto up = UpByTruth(poses, truth);
  if (!up || up->z() > std::cos(kMostTilt_rad)) return std::nullopt;
  PoseForm remedy = form;
  remedy.up = UpInWords(TurnUp(form.Up()).conjugate() * *up);
  return fmt::format("up of the truth is {} in the world of the estimate, not {}; give {}",
                     remedy.up, form.up, FormatOptions(remedy));
}

std::optional<RigidTransform> FindCameraPose(const std::string& calibration,
                                             const std::string& truth) {
  Warnings warnings;
  if (!calibration.empty()) return ReadCalibration(calibration, &warnings).rig.T_imu_camera[0];
  std::error_code error;
  const fs::path folder = fs::absolute(truth, error).parent_path();
  for (const fs::path& beside :
       {folder / "mav0", folder.parent_path() / "mav0", folder.parent_path(), folder}) {
    if (const auto found = CameraIn(beside.string())) return found;
  }
  return std::nullopt;
}

namespace {

using Json = nlohmann::ordered_json;

Json StatisticsJson(const ErrorStatistics& statistics) {
  return {{"rmse", statistics.rmse},
          {"mean", statistics.mean},
          {"median", statistics.median},
          {"max", statistics.max}};
}

Json AbsoluteJson(const AbsoluteError& error) {
  const Eigen::Vector3d& t = error.alignment.T_truth_estimate.translation;
  const Eigen::Quaterniond& q = error.alignment.T_truth_estimate.rotation;
  return {{"position_m", StatisticsJson(error.position_m)},
          {"rotation_deg", StatisticsJson(error.rotation_deg)},
          {"rmse_percent_of_path", error.rmse_percent},
          {"alignment",
           {{"scale", error.alignment.scale},
            {"translation_m", {t.x(), t.y(), t.z()}},
            {"rotation_qx_qy_qz_qw", {q.x(), q.y(), q.z(), q.w()}}}}};
}

Json RelativeJson(const RelativeError& error) {
  return {{"length_m", error.length_m},
          {"pieces", error.pieces},
          {"translation_rmse_percent", error.translation_rmse_percent},
          {"translation_median_percent", error.translation_median_percent},
          {"rotation_rmse_deg", error.rotation_rmse_deg},
          {"rotation_rmse_deg_per_m", error.rotation_rmse_deg_m}};
}

}  // namespace

Json TrajectoryJson(const EvaluationInputs& inputs, const TrajectoryMetrics& metrics) {
  Json json = {{"truth", inputs.truth},
               {"estimate", inputs.estimate},
               {"coverage",
                {{"stamps", inputs.stamps.empty() ? inputs.truth : inputs.stamps},
                 {"overall", metrics.coverage.overall},
                 {"after_initialisation", metrics.coverage.after_initialisation},
                 {"flagged", metrics.coverage.flagged}}},
               {"poses", metrics.estimated_poses},
               {"associated_poses", metrics.poses.size()},
               {"pieces", metrics.pieces},
               {"truth_length_m", metrics.truth_length_m},
               {"estimate_length_m", metrics.estimate_length_m}};
  for (const AbsoluteError& error : metrics.absolute) {
    json["ape"][AlignmentName(error.kind)] = AbsoluteJson(error);
  }
  json["rpe"] = Json::array();
  for (const RelativeError& error : metrics.relative) json["rpe"].push_back(RelativeJson(error));
  json["heading_error_at_end_deg"] = metrics.heading_error_deg;
  if (!inputs.finding.empty()) json["finding"] = inputs.finding;
  json["loop"] = nullptr;
  if (metrics.loop) {
    json["loop"] = {{"distance_m", metrics.loop->distance_m},
                    {"percent_of_path", metrics.loop->percent}};
  }
  return json;
}

}  // namespace slcmap::evaluation
