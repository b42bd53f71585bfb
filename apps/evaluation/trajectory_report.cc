#include "apps/evaluation/trajectory_report.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "mapping/external_poses/pose_reading.h"

namespace slcmap::inline evaluation {
namespace {

namespace fs = std::filesystem;

constexpr double kTruthGap_s = 0.1;

// Where the truth's up is in the estimate's world, by the turns between both worlds; nothing where
// these differ from pose to pose.
std::optional<Eigen::Vector3d> UpByTruth(const Trajectory& estimate, const Trajectory& truth) {
  constexpr double kMostSpread_rad = 0.1;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Quaterniond> turns;
  for (const StampedPose& pose : estimate) {
    const auto there = PoseAt(truth, pose.stamp_ns, kTruthGap_s);
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
    const auto there = PoseAt(truth, pose.stamp_ns, kTruthGap_s);
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
