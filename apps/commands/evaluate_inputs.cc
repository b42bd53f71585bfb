#include "apps/commands/evaluate_inputs.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <map>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/evaluation/trajectory_report.h"
#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/output_folder.h"
#include "export/export.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline commands {
namespace {

// The first column of a file such as cam0/data.csv, in nanoseconds.
std::vector<int64_t> ReadStamps(const std::string& path) {
  std::vector<int64_t> stamps_ns;
  ForEachRow(path, [&](int row, const std::vector<std::string_view>& fields) {
    const std::optional<int64_t> stamp_ns = ParseScaledInteger(fields[0], 0);
    if (!stamp_ns || (!stamps_ns.empty() && *stamp_ns <= stamps_ns.back())) {
      throw DataError(
          fmt::format("{}: row {}: found '{}', expected a stamp in nanoseconds after that "
                      "of the row before",
                      path, row, fields[0]));
    }
    stamps_ns.push_back(*stamp_ns);
  });
  if (stamps_ns.empty()) throw DataError(path + ": found no stamp, expected at least one row");
  return stamps_ns;
}

PoseForm FindForm(const EvaluationInputs& inputs, const char* file) {
  return inputs.form_of == file ? inputs.form : PoseForm();
}

// Rows without stamps are those of the images, or of the truth.
PoseTable ReadAtStamps(const std::string& path, const PoseForm& form, const Clock& images_ns,
                       const Clock& truth_ns) {
  if (images_ns.empty()) return ReadPoseTable(path, form, truth_ns, false);
  try {
    return ReadPoseTable(path, form, images_ns);
  } catch (const DataError&) {
    return ReadPoseTable(path, form, truth_ns, false);
  }
}

TrajectoryMetrics MeasureTrajectory(EvaluationInputs* inputs, double max_truth_gap_s) {
  const Trajectory truth = ReadTruth(*inputs);
  const ReadEstimate estimate = LoadEstimate(*inputs, truth);
  const std::vector<int64_t> stamps_ns =
      inputs->stamps.empty() ? std::vector<int64_t>() : ReadStamps(inputs->stamps);
  inputs->finding = FindOtherForm(estimate.table, estimate.form, truth, [&] {
                      return FindCameraPose(inputs->calibration, inputs->truth);
                    }).value_or("");
  try {
    return EvaluateTrajectory(truth, estimate.poses, stamps_ns, max_truth_gap_s);
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}{}", inputs->estimate, inputs->truth,
                                error.what(),
                                inputs->finding.empty() ? "" : "; " + inputs->finding));
  }
}

// Reading takes several times a file's size.
void CheckTrajectoryFile(const std::string& path) {
  constexpr uintmax_t kMaxBytes = 300000000;  // some three million poses
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw DataError(path + ": found a folder, expected a trajectory file (TUM or EuRoC)");
  }
  const uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error || bytes <= kMaxBytes) return;  // what is wrong with it, reading says
  throw DataError(fmt::format(
      "{}: found {} bytes, expected at most {}: a trajectory of some three million poses", path,
      bytes, kMaxBytes));
}

}  // namespace

std::string ImageStampsBeside(const std::string& truth) {
  const auto folder = std::filesystem::absolute(truth).parent_path().parent_path();
  const auto stamps = folder / "cam0" / "data.csv";
  std::error_code error;
  return std::filesystem::exists(stamps, error) ? stamps.lexically_normal().string() : "";
}

Trajectory ReadTruth(const EvaluationInputs& inputs) {
  const PoseForm form = FindForm(inputs, "truth");
  const Clock images_ns = inputs.stamps.empty() ? Clock() : ReadStamps(inputs.stamps);
  return CollectPoses(
      ReadPoseTable(inputs.truth, form, images_ns), form,
      form.IsOfCamera() ? FindCameraPose(inputs.calibration, inputs.truth) : std::nullopt);
}

ReadEstimate LoadEstimate(const EvaluationInputs& inputs, const Trajectory& truth) {
  ReadEstimate estimate;
  estimate.form = FindForm(inputs, "estimate");
  Clock truth_ns;
  for (const StampedPose& pose : truth) truth_ns.push_back(pose.stamp_ns);
  estimate.table =
      ReadAtStamps(inputs.estimate, estimate.form,
                   inputs.stamps.empty() ? Clock() : ReadStamps(inputs.stamps), truth_ns);
  estimate.poses = CollectPoses(
      estimate.table, estimate.form,
      estimate.form.IsOfCamera() ? FindCameraPose(inputs.calibration, inputs.truth) : std::nullopt);
  return estimate;
}

TrajectoryMetrics CompareTrajectories(EvaluationInputs* inputs, double max_truth_gap_s) {
  const EndsAtOnce nothing_is_written;
  for (const std::string& path : {inputs->truth, inputs->estimate}) CheckTrajectoryFile(path);
  return MeasureTrajectory(inputs, max_truth_gap_s);
}

namespace {

namespace fs = std::filesystem;

using WorldsOfRuns = std::map<std::string, RigidTransform>;  // T_world_run by the run's id

std::string GetFolder(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool Has(const std::string& folder, const char* name) {
  std::error_code error;
  return fs::exists(fs::path(folder) / name, error);
}

WorldsOfRuns CollectWorlds(const MapSource& source) {
  WorldsOfRuns worlds = {{source.run_id, source.T_world_run}};
  for (const MergedRun& run : source.merged) worlds[run.run_id] = run.T_world_run;
  return worlds;
}

// How the runs that a folder's files are of lie in the world of these; none of a folder of another
// kind. A file of that name may be of another program.
WorldsOfRuns WorldsIn(const std::string& folder) {
  try {
    if (Has(folder, "run.json")) return {{RunIdIn(folder), {}}};
    if (Has(folder, "map.json")) return CollectWorlds(MapSourceIn(folder));
    if (Has(folder, "export.json")) return CollectWorlds(ExportSourceIn(folder));
  } catch (const DataError& error) {
    spdlog::warn("{}; of which world the files beside it are is not known", error.what());
  }
  return {};
}

bool IsTurned(const RigidTransform& T) {
  constexpr double kLeast_rad = 1e-9;
  return LogRotation(T.rotation).norm() > kLeast_rad;
}

// How far a map that a file lies in is from where its poses were given.
Eigen::Vector3d OffsetIn(const std::string& folder) {
  try {
    if (!Has(folder, "map.json")) return Eigen::Vector3d::Zero();
    const auto place = MapSourceIn(folder).georeference;
    if (place && place->crs.empty() && place->turn_rad == 0) return place->origin_m;
  } catch (const DataError&) {  // WorldsIn says it
  }
  return Eigen::Vector3d::Zero();
}

RigidTransform TurnFromFile(const std::string& trajectory, const std::string& mapped_file) {
  const WorldsOfRuns mapped = WorldsIn(GetFolder(mapped_file)),
                     given = WorldsIn(GetFolder(trajectory));
  for (const auto& [run_id, T_mapped_run] : mapped) {
    if (run_id.empty()) continue;  // of any run that was killed
    const auto found = given.find(run_id);
    if (found != given.end()) return found->second * T_mapped_run.Inverse();
  }
  for (const auto& [run_id, T_mapped_run] : mapped) {
    if (!IsTurned(T_mapped_run)) continue;
    spdlog::warn(
        "{}: found a map that is turned by {:.2f} degrees against its run, expected a trajectory "
        "of "
        "it or of its run, where its stage wrote it; {} is taken to be in the map's world",
        mapped_file, LogRotation(T_mapped_run.rotation).norm() * 180 / M_PI, trajectory);
    break;
  }
  return {};
}

RigidTransform TrajectoryFromFile(const std::string& trajectory, const std::string& mapped_file) {
  RigidTransform T = TurnFromFile(trajectory, mapped_file);
  T.translation += OffsetIn(GetFolder(mapped_file)) - OffsetIn(GetFolder(trajectory));
  return T;
}

}  // namespace

RigidTransform TrajectoryFromMap(const std::string& trajectory,
                                 const std::vector<std::string>& mapped_files) {
  std::optional<RigidTransform> common;
  for (const std::string& file : mapped_files) {
    if (file.empty()) continue;
    const RigidTransform T = TrajectoryFromFile(trajectory, file);
    if (common && IsTurned(common->Inverse() * T)) {
      throw ConfigError(file + ": found it in another world than " + mapped_files.front() +
                        ", expected both of one map");
    }
    common = T;
  }
  return common.value_or(RigidTransform());
}

namespace {

bool IsThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// What lies in a folder that a stage wrote, or a recorder; "" in any other.
std::string DescribeContent(const fs::path& folder) {
  for (const StageMark& mark : StageMarks()) {
    try {
      if (IsOwn(GetState(folder.string(), mark))) return mark.result;
    } catch (const DataError&) {
      // Somebody else's, in a folder above: it cannot even be read.
    }
  }
  const bool is_recording = IsThere(folder / "cam0" / "data.csv") ||
                            IsThere(folder / "cam0" / "data") || IsThere(folder / "mav0" / "cam0");
  return is_recording ? "a recording" : "";
}

}  // namespace

void RefuseAsResult(const std::string& option, const std::string& path,
                    const std::vector<std::string>& inputs) {
  if (path.empty()) return;
  std::error_code error;
  for (const std::string& input : inputs) {
    if (input.empty() || !fs::equivalent(path, input, error) || error) continue;
    throw ConfigError(fmt::format(
        "{}: found {}, which is read, expected a path of its own: it would be overwritten", option,
        path));
  }
  fs::path folder = fs::weakly_canonical(fs::absolute(path, error), error);
  for (; !error && !folder.empty(); folder = folder.parent_path()) {
    if (const std::string content = DescribeContent(folder); !content.empty()) {
      throw ConfigError(fmt::format("{}: found {}, which lies in {} ({}), expected a place outside",
                                    option, path, content, folder.string()));
    }
    if (!folder.has_relative_path()) break;
  }
}

}  // namespace slcmap::commands
