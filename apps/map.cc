// slcmap map: the map of a run.
#include <memory>

#include "apps/commands.h"
#include "apps/folder_kind.h"
#include "apps/map_stage.h"
#include "apps/merge_stage.h"
#include "apps/pose_options.h"
#include "apps/sequence_options.h"
#include "apps/usage.h"
#include "apps/verdict_report.h"
#include "data/error.h"
#include "mapping/map_folder.h"

namespace slcmap {
namespace {

struct MapCommand {
  MapArguments arguments;
  std::string output;
};

void CheckInto(const MapArguments& arguments) {
  ParseStart(arguments.at);
  if (arguments.into.empty()) return;
  ExpectFolder(arguments.into, FolderKind::kMap);
  OptionsOfMerging(arguments.config, arguments.into);  // refuses them before the work is done
  if (!arguments.sparse) return;
  throw ConfigError(
      "--sparse: found it beside --into, which compares what images show; expected either");
}

void CheckInput(const MapArguments& arguments) {
  CheckThreads(arguments.threads);
  CheckInto(arguments);
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
  std::vector<std::string> inputs = FilesOf(arguments.opened);
  for (const std::string& input :
       {arguments.input, arguments.poses, arguments.sequence, arguments.into, arguments.config}) {
    if (!input.empty()) inputs.push_back(input);
  }
  OutputFolder output(command.output, MapFiles(), inputs);
  const MapResult map = RunMapStage(arguments, options, &output);
  if (map.verdict) LogVerdict(arguments.input, *map.verdict);
}

}  // namespace

void AddMapCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "map", "Build a map from a run folder, or from a sequence and poses by anyone");
  const auto map = std::make_shared<MapCommand>();
  MapArguments& arguments = map->arguments;
  command
      ->add_option("input", arguments.input,
                   "Run folder, as odometry writes it, or with --poses a sequence (EuRoC, TUM VI)")
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
  CLI::Option* into =
      command
          ->add_option(
              "--into", arguments.into,
              "Map folder of the same building: the run's map is merged into its world, as "
              "slcmap merge does it; the folder itself stays as it is")
          ->type_name("MAP");
  AddStartOption(*command, &arguments.at)->needs(into);
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
      "  slcmap map OUT2/run --into OUT/map -o BUILDING");
  command->callback([map] { Map(*map); });
}

}  // namespace slcmap
