// slcmap map: the map of a run.
#include "apps/commands/map_stage.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/trajectory.h"
#include "mapping/align/merge_maps.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/stage_store.h"
#include "mapping/mapping.h"
#include "mapping/views/recorded_views.h"
#include "odometry/run/run.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline commands {
namespace {

// As `slcmap run` lays folders out, the run of a map is beside it.
void RefuseOutdated(const std::string& folder, const MapResult& map) {
  const std::filesystem::path self = FolderItself(folder);
  if (self.filename() != "map") return;  // not laid out as `run` does it
  const std::string run = self.parent_path() / "run";
  const std::string found = RunIdIn(run);
  const std::vector<std::string> runs = CollectRuns(map);
  if (found.empty() || std::find(runs.begin(), runs.end(), found) != runs.end()) return;
  throw DataError(
      fmt::format("{}: found a map of run {}, expected one of run {}, which is in {}: map that run "
                  "first, or take the map as it is with --accept-changed",
                  folder, map.source.run_id, found, run));
}

MapResult Read(const std::string& folder, bool accept_changed) {
  const EndsAtOnce nothing_is_written;
  return ReadAccepting(accept_changed, [&](bool accept) {
    MapResult map = ReadMapFolder(folder, {.accept_changed = accept});
    if (!accept) RefuseOutdated(folder, map);
    return map;
  });
}

}  // namespace

MapResult ReadMapToShow(const std::string& folder, bool accept_changed) {
  MapResult map = Read(folder, accept_changed);
  if (!map.complete) spdlog::warn("{}: the map is partial: {}", folder, map.partial_reason);
  return map;
}

namespace {

// How often poses go on in another segment, which starts at the last pose of the one before.
int SegmentEnds(const OdometryRun& run) {
  int ends = 0;
  for (size_t i = 1; i < run.states.size(); ++i) {
    ends += run.states[i].segment != run.states[i - 1].segment;
  }
  return ends;
}

// Counted warnings are what tells why there are none.
void WarnOfNoPoses(const std::string& folder, const OdometryRun& run) {
  std::string reasons;
  for (const auto& [kind, count] : run.warnings) {
    reasons += fmt::format("; {}: {}", Warnings::InWords(kind), count);
  }
  spdlog::warn("{}: found no pose in the run, so the map is empty{}", folder, reasons);
}

void WarnOfImagesWithoutPose(const std::string& folder, const OdometryRun& run) {
  const auto without = run.warnings.find(kImageWithoutPose);
  if (without == run.warnings.end() || run.states.empty()) return;
  spdlog::warn(
      "{}: {} of {} images have no pose, and are left out: there are poses at images from "
      "{:.3f} to {:.3f} s",
      folder, without->second, without->second + static_cast<int64_t>(run.states.size()),
      ToSeconds(run.states.front().stamp_ns), ToSeconds(run.states.back().stamp_ns));
}

void WarnOfRun(const std::string& folder, const OdometryRun& run) {
  if (!run.complete) spdlog::warn("{}: the run is partial: {}", folder, run.partial_reason);
  if (run.states.empty()) WarnOfNoPoses(folder, run);
  WarnOfImagesWithoutPose(folder, run);
  if (const int ends = SegmentEnds(run); ends > 0) {
    spdlog::warn(
        "{}: the estimator lost itself {} times; the map behind each is shifted by what "
        "moved meanwhile",
        folder, ends);
  }
}

MapInput ReadInput(const MapArguments& arguments) {
  const EndsAtOnce nothing_is_written;
  if (!arguments.poses.empty()) {
    return ReadInputAtPoses(arguments.input, arguments.opened, arguments.poses, arguments.form);
  }
  OdometryRun run = ReadAccepting(arguments.accept_changed, [&](bool accept) {
    return ReadRunFolder(arguments.input, {.accept_changed = accept});
  });
  return {.run = std::move(run),
          .name = arguments.input,
          .recording = arguments.sequence,
          .sparse = arguments.sparse};
}

// What options cost is known late, by the run: their file is named then too.
template <typename Build>
MapResult NamingConfig(const std::string& config, Build build) {
  try {
    return build();
  } catch (const ConfigError& error) {
    throw ConfigError((config.empty() ? "" : config + ": ") + error.what());
  }
}

// Where what finished stages made is beside a map until that is done.
std::string StagesIn(const std::string& output) { return output + "/.stages"; }

}  // namespace

MappingOptions ReadMappingOptions(const std::string& config) {
  return config.empty() ? MappingOptions() : MappingOptions::FromYaml(config);
}

NamesFile::NamesFile(std::string path) : path_(std::move(path)) {
  if (!path_.empty()) names_ = ReadNames(path_);
}

void NamesFile::Apply(MapResult* map) const {
  try {
    ApplyNames(names_, map);
  } catch (const ConfigError& error) {
    throw NamingFile(path_, error);
  }
}

void AddNamesOption(CLI::App& command, std::string* path) {
  command
      .add_option("--names", *path,
                  "YAML file that says what buildings, storeys, rooms and doors are called, by "
                  "places; the page writes it too")
      ->type_name("FILE");
}

MapResult RunMapStage(const MapArguments& arguments, const MappingOptions& options, PlanStage* plan,
                      ControlStage* control, OutputFolder* output) {
  cv::setNumThreads(arguments.threads);  // odometry, which may have run before, has other threads
  const NamesFile names(arguments.names);
  MapInput input = ReadInput(arguments);
  const OdometryRun& run = input.run;
  const size_t landmarks = run.landmarks.size();
  spdlog::debug("{}: {} poses, {} keyframes, {} landmarks, {} lines", arguments.input,
                run.states.size(), run.keyframes.size(), landmarks, run.lines.size());
  WarnOfRun(arguments.input, run);
  if (run.source) RefuseInputs(output->path(), {run.source->sequence});
  output->Open();
  const std::string stages = StagesIn(output->path());
  // A run whose files were changed may be another one the next time.
  if (!arguments.accept_changed) input.stages = stages;
  input.control = control->FindInRun(run, arguments.sequence, StageProgress("tags"));
  MapResult map = NamingConfig(
      arguments.config, [&] { return BuildMap(std::move(input), options, StageProgress("map")); });
  if (!Interrupted()) control->Place(&map);
  if (!Interrupted()) plan->Compare(StageProgress("plan"), &map);
  names.Apply(&map);
  map.id = WriteMapFolder(output, map);
  if (!map.interrupted) StageStore::Remove(stages);  // else it goes on from them
  spdlog::info(
      "wrote {}: {} poses, {} points of {} landmarks, {} lines, {} occupied voxels of {} m",
      output->path(), map.trajectory.size(), map.points.size(), landmarks, map.lines.size(),
      map.occupancy.OccupiedVoxels().size(), map.occupancy.resolution_m());
  if (Interrupted() && !map.complete) {
    spdlog::warn("{}: the map is partial: {}", output->path(), map.partial_reason);
  }
  return map;
}

namespace {

struct MapCommand {
  MapArguments arguments;
  PlanArguments plan;
  ControlArguments control;
  std::string output;
};

void CheckInput(const MapArguments& arguments) {
  CheckThreads(arguments.threads);
  if (arguments.poses.empty()) {
    ExpectFolder(arguments.input, FolderKind::kRun);
    return;
  }
  ExpectFolder(arguments.input, FolderKind::kSequence);
  if (arguments.sparse) {
    throw ConfigError(
        "--sparse: found it beside --poses, which bring no landmarks; expected either");
  }
}

void Map(const MapCommand& command) {
  const MapArguments& arguments = command.arguments;
  const MappingOptions options = ReadMappingOptions(arguments.config);
  CheckInput(arguments);
  PlanStage plan(command.plan);
  ControlStage control(command.control);
  std::vector<std::string> inputs = CollectFiles(arguments.opened);
  for (const std::string& file : command.control.Files()) inputs.push_back(file);
  for (const std::string& input : {arguments.input, arguments.poses, arguments.sequence,
                                   arguments.config, arguments.names, command.plan.plan}) {
    if (!input.empty()) inputs.push_back(input);
  }
  OutputFolder output(command.output, MapFiles(), inputs);
  const MapResult map = RunMapStage(arguments, options, &plan, &control, &output);
  if (map.verdict) LogVerdict(arguments.input, *map.verdict);
  plan.RequirePlaced();
  control.RequirePlaced();
}

}  // namespace

void AddMapCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "map", "Build a map from a run folder, or from a sequence and poses by anyone");
  const auto map = std::make_shared<MapCommand>();
  MapArguments& arguments = map->arguments;
  command
      ->add_option("input", arguments.input,
                   "Run folder, as odometry writes it, or with --poses a sequence")
      ->type_name("RUN|SEQ")
      ->required();
  command->add_option("-o,--output", map->output, "Map folder to write")
      ->type_name("MAP")
      ->required();
  CLI::Option* poses = command->add_option(
      "--poses", arguments.poses,
      "Poses of the sequence's IMU in metres, z up, TUM, EuRoC or KITTI file: from another SLAM, "
      "COLMAP, a tracker");
  for (CLI::Option* option : AddSequenceOptions(*command, &arguments.opened)) option->needs(poses);
  for (CLI::Option* option : AddPoseOptions(*command, &arguments.form)) option->needs(poses);
  command
      ->add_option("--sequence", arguments.sequence,
                   "Where the recording of the run is, if it has moved since")
      ->excludes(poses);
  AddPlanOptions(*command, &map->plan);
  AddControlOptions(*command, &map->control);
  AddNamesOption(*command, &arguments.names);
  command->add_flag("--sparse", arguments.sparse,
                    "Map the landmarks and lines of the run alone, without opening its images");
  command->add_option("--config", arguments.config,
                      "YAML file whose section `mapping` overrides options");
  command->add_option("--threads", arguments.threads, "Threads; the bytes are the same with any")
      ->capture_default_str();
  command->add_flag("--accept-changed", arguments.accept_changed,
                    "Also take files that are not as odometry wrote them; their values are checked "
                    "in any case");
  command->footer(
      "Examples:\n  slcmap map OUT/run -o OUT/map\n"
      "  slcmap map SEQ --poses poses.tum -o MAP\n"
      "  slcmap map OUT/run --control control.csv --crs EPSG:25832 -o OUT/map\n"
      "  slcmap map OUT/run --plan floor.png --plan-pixel-m 0.01 -o OUT/map");
  command->callback([map] { Map(*map); });
}

}  // namespace slcmap::commands
