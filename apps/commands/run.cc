// slcmap run: all stages, from a recorded sequence to files that other programs show.
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/convert.h"
#include "apps/commands/export.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "apps/evaluation/trajectory_metrics.h"
#include "data/core/error.h"
#include "data/source/sequence.h"
#include "export/export.h"
#include "mapping/map/map_folder.h"

namespace slcmap::inline commands {
namespace {

struct RunArguments {
  OdometryArguments odometry;
  VideoRecording video;
  PlanArguments plan;
  ControlArguments control;
  std::string output, names;
  ExportOptions exporting;
};

// Runs a stage and says how long it took.
template <typename Stage>
auto Timed(const char* name, Stage stage) {
  const auto start = std::chrono::steady_clock::now();
  auto result = stage();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  spdlog::info("{} took {:.2f} s", name, wall.count());
  return result;
}

void PrintAccuracy(const char* name, const Trajectory& truth, const Trajectory& estimate,
                   const std::vector<int64_t>& image_stamps_ns) {
  try {
    const TrajectoryMetrics metrics = EvaluateTrajectory(truth, estimate, image_stamps_ns);
    const AbsoluteError& error = metrics.absolute.front();
    std::printf("accuracy  %-8s APE %.4f m RMSE (%s), %.2f %% of %.2f m, coverage %.1f %%\n", name,
                error.position_m.rmse, AlignmentName(error.kind).c_str(), error.rmse_percent,
                metrics.truth_length_m, 100 * metrics.coverage.after_initialisation);
  } catch (const DataError& error) {  // such as a truth that covers another time
    spdlog::warn("{} poses: {}", name, error.what());
  }
}

void PrintAccuracies(const std::string& sequence, const OdometryRun& run, const MapResult& map) {
  const std::string truth_path = FindTruth(LocateRecording(sequence));
  if (truth_path.empty()) return;
  const Trajectory truth = ReadTrajectory(truth_path);
  std::vector<int64_t> stamps_ns;  // of the part that was asked for
  for (const StereoEntry& images : run.source->images) stamps_ns.push_back(images.stamp_ns);
  PrintAccuracy("online", truth, OnlinePoses(run.states), stamps_ns);
  PrintAccuracy("refined", truth, map.trajectory, stamps_ns);
}

void PrintCost(const RunTimings& timings) {
  const double frames = static_cast<double>(std::max<int64_t>(timings.stereo_frames, 1));
  std::printf("cost      %.1f ms CPU an image, %.1f x real time, %.0f MiB at most\n",
              1e3 * timings.cpu_s / frames, timings.data_s / std::max(timings.wall_s, 1e-9),
              timings.peak_memory_mib);
}

std::string PageIn(const std::string& output) { return output + "/map.html"; }

// The path of the map's page; "" where the program was built without it.
std::string WriteRunPage(const MapResult& map, const std::string& output) {
  std::string page_template;
  try {
    page_template = ReadPageTemplate();
  } catch (const DataError& error) {
    spdlog::warn("{}", error.what());
    return "";
  }
  WritePage(map, page_template, TitleOfMap(output + "/map"), {}, PageIn(output),
            StageProgress("view"));
  return PageIn(output);
}

// The folder of a video's images, which odometry and map read.
std::string UnpackGivenVideo(const RunArguments& arguments) {
  const OdometryArguments& odometry = arguments.odometry;
  const std::string& video = odometry.sequence;
  // What would be refused afterwards.
  CheckThreads(odometry.threads);
  odometry.part.Check();
  if (!odometry.method.empty()) CheckMethodName("--method", odometry.method);
  if (!odometry.opened.topics.empty()) {
    throw ConfigError(video + ": found --topics for a video, expected them for a bag");
  }
  if (odometry.opened.calibration.empty()) {
    throw ConfigError(video +
                      ": found a video, which tells no calibration, expected --calibration "
                      "rig.yaml; slcmap calibration reads those of others");
  }
  const std::string folder = arguments.output + "/recording";
  if (Exists(folder + "/mav0")) {
    throw ConfigError(fmt::format(
        "output {0}: found images of a video already, expected none: go on with them by "
        "slcmap run {0} and another OUT, or remove them",
        folder));
  }
  UnpackVideoInto(folder, video, arguments.video);
  return folder;
}

void RunAll(const RunArguments& arguments) {
  const std::string& output = arguments.output;
  if (output.empty()) throw ConfigError("output: found an empty path, expected a folder");
  OdometryArguments odometry = arguments.odometry;
  odometry.run = output + "/run";
  const bool is_video = CheckVideoOptions(odometry.sequence, arguments.video);
  std::vector<std::string> inputs = ListInputs(odometry);
  if (!arguments.names.empty()) inputs.push_back(arguments.names);
  const NamesFile names(arguments.names);  // refused before the work
  if (!arguments.plan.plan.empty()) inputs.push_back(arguments.plan.plan);
  for (const std::string& file : arguments.control.Files()) inputs.push_back(file);
  for (const std::string& log : arguments.video.logs) inputs.push_back(log);
  for (const std::string& file : {arguments.video.right, arguments.video.frame_times}) {
    if (!file.empty()) inputs.push_back(file);
  }
  RefuseInputs(output, inputs);
  const MappingOptions mapping = ReadMappingOptions(odometry.config);
  CheckFormats(arguments.exporting);
  PlanStage plan(arguments.plan);
  ControlStage control(arguments.control);
  CheckPagePlace(PageIn(output));
  auto map_folder = std::make_unique<OutputFolder>(output + "/map", MapFiles(), inputs);
  OutputFolder export_folder(output + "/export", ExportFiles(), inputs);
  if (is_video) odometry.sequence = UnpackGivenVideo(arguments);
  const OdometryRun run = RunOdometryStage(odometry, [&] {
    // What the new run makes outdated does not stay where it would be taken for the new one's.
    map_folder->Open();
    export_folder.Open();
    map_folder->MoveAside();
    export_folder.MoveAside();
    RemovePage(PageIn(output));
  });
  if (Interrupted()) return;
  MapArguments of_run;
  of_run.input = odometry.run;
  of_run.threads = odometry.threads;
  of_run.names = arguments.names;
  Timed("map", [&] { return RunMapStage(of_run, mapping, &plan, &control, map_folder.get()); });
  if (Interrupted()) return;
  // What is shown is what the folder holds, whose numbers are rounded.
  map_folder.reset();
  const MapResult map = ReadMapFolder(output + "/map");
  ExportOptions exporting = arguments.exporting;
  exporting.recording.calibration = output + "/map/calibration.yaml";
  exporting.tiles_page = FindTilesPage();
  const std::vector<std::string> files = Timed(
      "export", [&] { return ExportMap(map, &export_folder, exporting, StageProgress("export")); });
  const std::string page = WriteRunPage(map, output);
  PrintAccuracies(odometry.sequence, run, map);
  PrintCost(run.timings);
  std::printf("results   %s/run, %s/map\n", output.c_str(), output.c_str());
  for (const std::string& file : files) std::printf("open      %s\n", file.c_str());
  if (!page.empty()) std::printf("open      %s\n", page.c_str());
  PrintVerdict(map.verdict ? *map.verdict : *run.verdict);
  RefuseFailed(odometry.run, run);
  plan.RequirePlaced();
  control.RequirePlaced();
}

}  // namespace

void AddRunCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("run", "Run all stages: odometry, map, export");
  const auto arguments = std::make_shared<RunArguments>();
  AddOdometryOptions(*command, &arguments->odometry);
  AddVideoOptions(*command, &arguments->video);
  command
      ->add_option("-o,--output", arguments->output,
                   "Folder for the results: run, map, export and map.html")
      ->type_name("OUT")
      ->required();
  AddPlanOptions(*command, &arguments->plan);
  AddControlOptions(*command, &arguments->control);
  AddNamesOption(*command, &arguments->names);
  AddExportOptions(*command, &arguments->exporting);
  command->footer(
      "Examples:\n  slcmap run MH_01_easy -o out\n"
      "  slcmap run MH_01_easy -o out --from 40 --duration 20 --format glb\n"
      "  slcmap run walk.mp4 --imu imu.csv --calibration rig.yaml -o out\n"
      "      a video: it is written as images to out/recording first\n\n"
      "Where the sequence holds true poses, the accuracy is printed too.\n\n" +
      std::string(kVerdictHelp));
  command->callback([arguments] { RunAll(*arguments); });
}

}  // namespace slcmap::commands
