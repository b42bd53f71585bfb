// slcmap map: the map of a run.
#include <memory>

#include "apps/commands.h"
#include "apps/folder_kind.h"
#include "apps/map_stage.h"
#include "apps/verdict_report.h"
#include "mapping/map_folder.h"

namespace slcmap {
namespace {

struct MapArguments {
  std::string run, output, config;
  bool accept_changed = false;
};

void Map(const MapArguments& arguments) {
  const MappingOptions options = ReadMappingOptions(arguments.config);
  ExpectFolder(arguments.run, FolderKind::kRun);
  OutputFolder output(arguments.output, MapFiles(), {arguments.run});
  const MapResult map = RunMapStage(arguments.run, options, arguments.accept_changed, &output);
  LogVerdict(arguments.run, *map.verdict);
}

}  // namespace

void AddMapCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("map", "Build a map from a run folder");
  const auto arguments = std::make_shared<MapArguments>();
  command->add_option("run", arguments->run, "Run folder, as odometry writes it")
      ->type_name("RUN")
      ->required();
  command->add_option("-o,--output", arguments->output, "Map folder to write")
      ->type_name("MAP")
      ->required();
  command->add_option("--config", arguments->config,
                      "YAML file whose section `mapping` overrides options");
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as odometry wrote them; their values are checked "
                    "in any case");
  command->footer("Example:\n  slcmap map OUT/run -o OUT/map");
  command->callback([arguments] { Map(*arguments); });
}

}  // namespace slcmap
