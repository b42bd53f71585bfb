// slcmap evaluate: an estimated trajectory against the true one.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/truth.h"
#include "apps/maps/measured_map.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/io/csv.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"
#include "data/io/true_building.h"
#include "export/export.h"
#include "mapping/map/building.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/part_files.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

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

// Reading takes several times a file's size.
void CheckTrajectoryFile(const std::string& path) {
  constexpr uintmax_t kMaxBytes = 300000000;  // some three million poses
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw DataError(path + ": found a folder, expected a trajectory file (TUM or EuRoC)");
  }
  const uintmax_t bytes = fs::file_size(path, error);
  if (error || bytes <= kMaxBytes) return;  // what is wrong with it, reading says
  throw DataError(fmt::format(
      "{}: found {} bytes, expected at most {}: a trajectory of some three million poses", path,
      bytes, kMaxBytes));
}

// The stamps of the images beside a EuRoC ground truth (mav0/*/data.csv); empty where there are
// none.
std::string ImageStampsBeside(const std::string& truth) {
  const auto folder = fs::absolute(truth).parent_path().parent_path();
  const auto stamps = folder / "cam0" / "data.csv";
  return Exists(stamps) ? stamps.lexically_normal().string() : "";
}

// The true poses of the IMU. Throws DataError.
Trajectory ReadTruth(const EvaluationInputs& inputs) {
  const PoseForm form = FindForm(inputs, "truth");
  const Clock images_ns = inputs.stamps.empty() ? Clock() : ReadStamps(inputs.stamps);
  return CollectPoses(
      ReadPoseTable(inputs.truth, form, images_ns), form,
      form.IsOfCamera() ? FindCameraPose(inputs.calibration, inputs.truth) : std::nullopt);
}

// Compares both, and says in `inputs` what of their forms does not agree. Rows of the estimate
// without stamps have those of the images, or of the truth. Throws DataError.
TrajectoryMetrics CompareTrajectories(EvaluationInputs* inputs, double max_truth_gap_s) {
  const EndsAtOnce nothing_is_written;
  for (const std::string& path : {inputs->truth, inputs->estimate}) CheckTrajectoryFile(path);
  const auto camera = [&] { return FindCameraPose(inputs->calibration, inputs->truth); };
  const Trajectory truth = ReadTruth(*inputs);
  const Clock stamps_ns = inputs->stamps.empty() ? Clock() : ReadStamps(inputs->stamps);
  Clock truth_ns;
  for (const StampedPose& pose : truth) truth_ns.push_back(pose.stamp_ns);
  const PoseForm form = FindForm(*inputs, "estimate");
  const PoseTable table = ReadAtStamps(inputs->estimate, form, stamps_ns, truth_ns);
  const Trajectory estimate =
      CollectPoses(table, form, form.IsOfCamera() ? camera() : std::nullopt);
  inputs->finding = FindOtherForm(table, form, truth, camera).value_or("");
  try {
    return EvaluateTrajectory(truth, estimate, stamps_ns, max_truth_gap_s);
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}{}", inputs->estimate, inputs->truth,
                                error.what(),
                                inputs->finding.empty() ? "" : "; " + inputs->finding));
  }
}

using WorldsOfRuns = std::map<std::string, RigidTransform>;  // T_world_run by the run's id

std::string GetFolder(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
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
    if (Exists(folder + "/run.json")) return {{RunIdIn(folder), {}}};
    if (Exists(folder + "/map.json")) return CollectWorlds(MapSourceIn(folder));
    if (Exists(folder + "/export.json")) return CollectWorlds(ExportSourceIn(folder));
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
    if (!Exists(folder + "/map.json")) return Eigen::Vector3d::Zero();
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

// The world of files that lie in a map or export folder, in that of a trajectory: a map is turned
// along its building, its run is not. Where both are of one run, by the summaries beside them, that
// tells; else it is taken to be the same world, with a warning where the map is turned against its
// run, or a summary cannot be read. Throws ConfigError where files are of different worlds.
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

// What lies in a folder that a stage wrote, or a recorder; "" in any other.
std::string DescribeContent(const fs::path& folder) {
  for (const StageMark& mark : StageMarks()) {
    try {
      if (IsOwn(GetState(folder.string(), mark))) return mark.result;
    } catch (const DataError&) {
      // Somebody else's, in a folder above: it cannot even be read.
    }
  }
  const bool is_recording = Exists(folder / "cam0" / "data.csv") ||
                            Exists(folder / "cam0" / "data") || Exists(folder / "mav0" / "cam0");
  return is_recording ? "a recording" : "";
}

// Throws ConfigError naming the option where `path`, of a file or a folder, is one of the inputs,
// or is or lies in the folder of a run, a map, an export or a recording: nothing of these is
// overwritten, nor anything added to them. An empty path is none.
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

struct EvaluateArguments {
  EvaluationInputs inputs;
  ComparedFiles lines;
  SurfaceInputs surfaces;
  ComparedFiles building;
  ComparedFiles pipes;
  ExternalMapArguments maps;
  std::string json;
  double max_truth_gap_s = kMaxTruthGap_s;
  int max_samples = kMostLineSamples;
  VisibilityOptions visibility;
};

// How well the cameras saw the edges, where the surfaces and the calibration lie beside them.
void LookAtEdges(const EvaluateArguments& arguments, TrueEdges* edges) {
  const fs::path beside(arguments.lines.truth);
  const std::string surfaces = fs::path(beside).replace_filename("surfaces.ply");
  const std::string rig = fs::path(beside).replace_filename("rig.yaml");
  if (!Exists(surfaces) || !Exists(rig)) return;
  Warnings warnings;
  edges->clear =
      ClearlySeen(*edges, TriangleTree(ReadSurfaces(surfaces)), ReadTruth(arguments.inputs),
                  ReadCalibration(rig, &warnings).rig, StageProgress("edges"));
}

// The marks of a map, beside its lines.
std::optional<std::vector<MapLine>> MarksBeside(const std::string& lines) {
  const std::string path = fs::path(lines).replace_filename("marks.ply");
  if (!Exists(path)) return std::nullopt;
  return ReadMapLines(path);
}

Json EvaluateLineMap(const EvaluateArguments& arguments, const Alignment& alignment) {
  const ComparedFiles& inputs = arguments.lines;
  TrueEdges truth;
  std::vector<MapLine> lines;
  std::optional<std::vector<MapLine>> marks;
  {
    const EndsAtOnce nothing_is_written;
    truth = ReadTrueEdges(inputs.truth);
    lines = Aligned(alignment, ReadMapLines(inputs.mapped));
    marks = MarksBeside(inputs.mapped);
  }
  LookAtEdges(arguments, &truth);
  spdlog::debug("{} true edges, {} lines", truth.seen.size(), lines.size());
  LineMetrics metrics;
  try {
    metrics = EvaluateLines(truth, lines, arguments.max_samples, StageProgress("lines"));
    if (marks) {
      EvaluateMarks(truth, Aligned(alignment, *marks), arguments.max_samples, &metrics);
    }
  } catch (const DataError& error) {
    throw DataError(fmt::format("{} against {}: {}", inputs.mapped, inputs.truth, error.what()));
  }
  return LineJson(inputs, metrics);
}

Json EvaluateSurfaceMap(const EvaluateArguments& arguments, const Alignment& alignment) {
  const SurfaceInputs& inputs = arguments.surfaces;
  const Trajectory truth = ReadTruth(arguments.inputs);
  const SurfaceMetrics metrics =
      EvaluateSurfaces(inputs, truth, alignment, arguments.visibility, StageProgress("surfaces"));
  return SurfaceJson(inputs, metrics);
}

Json EvaluateMappedBuilding(const EvaluateArguments& arguments, const Alignment& alignment) {
  const ComparedFiles& inputs = arguments.building;
  const EndsAtOnce nothing_is_written;
  const TrueBuilding truth = ReadTrueBuilding(inputs.truth);
  const fs::path folder = fs::path(inputs.mapped).parent_path();
  const Building building =
      Aligned(alignment, ReadBuilding(folder.empty() ? "." : folder.string()));
  const BuildingMetrics metrics = EvaluateBuilding(truth, building);
  return BuildingJson(inputs, metrics);
}

Json EvaluatePipeMap(const ComparedFiles& inputs, const Alignment& alignment) {
  const EndsAtOnce nothing_is_written;
  const std::vector<TruePipe> truth = ReadTruePipes(inputs.truth);
  const PipeMetrics metrics = EvaluatePipes(truth, Aligned(alignment, ReadPipes(inputs.mapped)));
  return PipeJson(inputs, metrics);
}

// Before anything is read.
void CheckPaths(const EvaluateArguments& a) {
  const std::vector<std::string> inputs = {
      a.inputs.truth,       a.inputs.estimate,        a.inputs.stamps,   a.lines.truth,
      a.lines.mapped,       a.surfaces.true_surfaces, a.surfaces.rig,    a.surfaces.cloud,
      a.surfaces.occupancy, a.building.truth,         a.building.mapped, a.pipes.truth,
      a.pipes.mapped};
  RefuseAsResult("--json", a.json, inputs);
}

void Evaluate(EvaluateArguments arguments) {
  EvaluationInputs& inputs = arguments.inputs;
  if (arguments.max_samples < 1) {
    throw ConfigError(
        fmt::format("--max-samples: found {}, expected at least 1", arguments.max_samples));
  }
  CheckPaths(arguments);
  if (inputs.stamps.empty()) inputs.stamps = ImageStampsBeside(inputs.truth);
  const TrajectoryMetrics metrics = CompareTrajectories(&inputs, arguments.max_truth_gap_s);
  if (!inputs.finding.empty()) spdlog::warn("{}: {}", inputs.estimate, inputs.finding);
  if (metrics.coverage.flagged) {
    spdlog::warn("{}: too few poses to compare its errors", inputs.estimate);
  }
  Json json = TrajectoryJson(inputs, metrics);
  std::fputs(FiguresText(json).c_str(), stdout);
  const auto add = [&](const char* name, const Json& figures) {
    std::fputs(("\n" + FiguresText({{name, figures}})).c_str(), stdout);
    json[name] = figures;
  };
  const auto aligned = [&](const std::vector<std::string>& mapped_files) {
    Alignment alignment = metrics.absolute.front().alignment;
    alignment.T_truth_estimate =
        alignment.T_truth_estimate * TrajectoryFromMap(inputs.estimate, mapped_files);
    return alignment;
  };
  try {
    if (const std::string& lines = arguments.lines.mapped; !lines.empty()) {
      add("lines", EvaluateLineMap(arguments, aligned({lines})));
    }
    if (const SurfaceInputs& surfaces = arguments.surfaces; !surfaces.true_surfaces.empty()) {
      add("surfaces", EvaluateSurfaceMap(arguments, aligned({surfaces.cloud, surfaces.occupancy})));
    }
    if (const std::string& planes = arguments.building.mapped; !planes.empty()) {
      add("building", EvaluateMappedBuilding(arguments, aligned({planes})));
    }
    if (const std::string& pipes = arguments.pipes.mapped; !pipes.empty()) {
      add("pipes", EvaluatePipeMap(arguments.pipes, aligned({pipes})));
    }
  } catch (const StoppedError& error) {
    json["partial_reason"] = error.what();
    if (!arguments.json.empty()) WriteJsonFile(arguments.json, json);
    throw;
  }
  if (!arguments.json.empty()) WriteJsonFile(arguments.json, json);
}

// Maps by any system, each by itself and against a scan, without a trajectory.
void EvaluateMaps(const EvaluateArguments& arguments) {
  const EndsAtOnce nothing_is_written;
  const MapsToMeasure maps = CollectMaps(arguments.maps);
  RefuseAsResult("--json", arguments.json, CollectFiles(maps));
  const MapMeasures measured = MeasureMaps(maps, StageProgress("maps"));
  std::fputs(MapTable(measured.maps).c_str(), stdout);
  if (!arguments.json.empty()) WriteJsonFile(arguments.json, MapsJson(measured.maps));
  if (!measured.failures.empty()) throw DataError(measured.failures);
}

void AddPipeOptions(CLI::App* command, ComparedFiles* inputs) {
  CLI::Option* truth = command->add_option("--true-pipes", inputs->truth,
                                           "True pipes: truth/pipes.csv of a simulated sequence");
  CLI::Option* pipes =
      command->add_option("--pipes", inputs->mapped, "Mapped pipes: pipes.json of a map");
  truth->needs(pipes);
  pipes->needs(truth);
}

void AddSurfaceOptions(CLI::App* command, EvaluateArguments* arguments) {
  SurfaceInputs& inputs = arguments->surfaces;
  CLI::Option* surfaces = command->add_option("--true-surfaces", inputs.true_surfaces,
                                              "True surfaces, a PLY of faces: surfaces.ply of a "
                                              "simulated sequence, in the world of --truth");
  command
      ->add_option("--true-rig", inputs.rig,
                   "True calibration, a Kalibr chain (default: rig.yaml beside the surfaces)")
      ->needs(surfaces);
  command
      ->add_option("--cloud", inputs.cloud,
                   "Points of a map, a PLY, in the world of the estimate; compared with what the "
                   "cameras saw of the surfaces")
      ->needs(surfaces);
  command
      ->add_option("--occupancy", inputs.occupancy,
                   "Occupancy of a map, a .bt file, in the world of the estimate")
      ->needs(surfaces);
  command
      ->add_option("--look-every", arguments->visibility.interval_s,
                   "Time [s] between the true poses that the surfaces are looked at from")
      ->capture_default_str();
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare a trajectory, and mapped lines, with the true ones");
  const auto arguments = std::make_shared<EvaluateArguments>();
  CLI::Option* truth =
      command->add_option("--truth", arguments->inputs.truth, "True trajectory, TUM or EuRoC file");
  CLI::Option* estimate = command->add_option("--estimate", arguments->inputs.estimate,
                                              "Estimated trajectory, TUM or EuRoC file");
  CLI::Option* maps = AddExternalMapOptions(*command, &arguments->maps);
  for (CLI::Option* trajectory : {truth, estimate}) maps->excludes(trajectory);
  command->add_option("--stamps", arguments->inputs.stamps,
                      "File whose first column holds the stamps [ns] that should have a pose "
                      "(default: ../cam0/data.csv beside the truth, else the truth's)");
  AddPoseOptions(*command, &arguments->inputs.form);
  command
      ->add_option("--form-of", arguments->inputs.form_of,
                   "Which file those options are of: estimate or truth")
      ->check(CLI::IsMember({"estimate", "truth"}))
      ->capture_default_str();
  command->add_option("--calibration", arguments->inputs.calibration,
                      "Kalibr camera chain, or a folder with sensor.yaml files, for poses of the "
                      "camera (default: that beside the truth)");
  CLI::Option* true_edges =
      command->add_option("--true-edges", arguments->lines.truth,
                          "True edges: edges.csv of a simulated sequence, or an edge-PLY");
  CLI::Option* lines =
      command->add_option("--lines", arguments->lines.mapped,
                          "Mapped lines, an edge-PLY, in the world of the estimate");
  command->callback([=] {
    if (maps->count() > 0) return EvaluateMaps(*arguments);
    if (truth->count() == 0) throw CLI::RequiredError("--truth");
    if (estimate->count() == 0) throw CLI::RequiredError("--estimate");
    Evaluate(*arguments);
  });
  lines->needs(true_edges);
  true_edges->needs(lines);
  AddSurfaceOptions(command, arguments.get());
  CLI::Option* true_building =
      command->add_option("--true-building", arguments->building.truth,
                          "True walls and rooms: truth/building.json of a simulated sequence");
  CLI::Option* planes =
      command->add_option("--planes", arguments->building.mapped,
                          "planes.json of a map, with rooms.json and plan.json beside it");
  true_building->needs(planes);
  planes->needs(true_building);
  AddPipeOptions(command, &arguments->pipes);
  command->add_option("--json", arguments->json, "Write the figures to this file");
  command
      ->add_option("--max-samples", arguments->max_samples,
                   "Refuse lines and edges that take more samples, of 2 cm each")
      ->capture_default_str();
  command
      ->add_option("--max-truth-gap", arguments->max_truth_gap_s,
                   "Longest gap [s] across which the truth is interpolated")
      ->capture_default_str();
  command->footer(
      "Example:\n  slcmap evaluate --truth SEQ/mav0/state_groundtruth_estimate0/data.csv \\\n"
      "      --estimate OUT/run/trajectory.tum --json metrics.json\n"
      "  slcmap evaluate --truth SEQ/truth/trajectory.tum --estimate RUN/trajectory.tum \\\n"
      "      --true-edges SEQ/truth/edges.csv --lines RUN/lines.ply\n"
      "  slcmap evaluate --truth SEQ/truth/trajectory.tum --estimate MAP/trajectory.tum \\\n"
      "      --true-surfaces SEQ/truth/surfaces.ply --cloud MAP/dense.ply --occupancy "
      "MAP/occupancy.bt\n"
      "  slcmap evaluate --maps other=cloud.ply --true-map scan.las");
}

}  // namespace slcmap::commands
