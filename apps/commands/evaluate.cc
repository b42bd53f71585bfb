// slcmap evaluate: an estimated trajectory against the true one.
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/evaluate_inputs.h"
#include "apps/commands/external_maps.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "apps/evaluation/building_metrics.h"
#include "apps/evaluation/line_metrics.h"
#include "apps/evaluation/report.h"
#include "apps/evaluation/surface_metrics.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "apps/evaluation/trajectory_report.h"
#include "apps/evaluation/truth.h"
#include "apps/maps/measured_map.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/io/json.h"
#include "data/io/true_building.h"
#include "mapping/map/building.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline commands {
namespace {

struct EvaluateArguments {
  EvaluationInputs inputs;
  ComparedFiles lines;
  SurfaceInputs surfaces;
  ComparedFiles building;
  ComparedFiles pipes;
  ExternalMapArguments maps;
  std::string json;
  double max_truth_gap_s = kMaxTruthGap_s;
  LineMetricOptions line_options;
  VisibilityOptions visibility;
};

// How well the cameras saw the edges, where the surfaces and the calibration lie beside them.
void LookAtEdges(const EvaluateArguments& arguments, TrueEdges* edges) {
  const std::filesystem::path beside(arguments.lines.truth);
  const std::string surfaces = std::filesystem::path(beside).replace_filename("surfaces.ply");
  const std::string rig = std::filesystem::path(beside).replace_filename("rig.yaml");
  std::error_code error;
  if (!std::filesystem::exists(surfaces, error) || !std::filesystem::exists(rig, error)) return;
  Warnings warnings;
  edges->clear =
      ClearlySeen(*edges, TriangleTree(ReadSurfaces(surfaces)), ReadTruth(arguments.inputs),
                  ReadCalibration(rig, &warnings).rig, StageProgress("edges"));
}

// The marks of a map, beside its lines.
std::optional<std::vector<MapLine>> MarksBeside(const std::string& lines) {
  const std::string path = std::filesystem::path(lines).replace_filename("marks.ply");
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
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
    metrics = EvaluateLines(truth, lines, arguments.line_options, StageProgress("lines"));
    if (marks) {
      EvaluateMarks(truth, Aligned(alignment, *marks), arguments.line_options, &metrics);
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
  const std::filesystem::path folder = std::filesystem::path(inputs.mapped).parent_path();
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
  arguments.line_options.Check();
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
  const std::vector<MeasuredMap> measured = MeasureMaps(maps, StageProgress("maps"));
  std::fputs(MapTable(measured).c_str(), stdout);
  if (!arguments.json.empty()) WriteJsonFile(arguments.json, MapsJson(measured));
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
      ->add_option("--max-samples", arguments->line_options.max_samples,
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
