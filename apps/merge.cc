// slcmap merge: maps of one building as one.
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands.h"
#include "apps/folder_kind.h"
#include "apps/map_input.h"
#include "apps/merge_stage.h"
#include "apps/progress.h"
#include "apps/usage.h"
#include "data/error.h"
#include "data/output_folder.h"
#include "mapping/map_folder.h"
#include "mapping/merge/merge_maps.h"

namespace slcmap {
namespace {

struct MergeArguments {
  std::vector<std::string> maps;
  std::string output, at, config;
  int threads = 2;
  bool accept_changed = false;
};

void RefuseWrongMaps(const MergeArguments& arguments) {
  CheckThreads(arguments.threads);
  if (arguments.maps.size() < 2) {
    throw ConfigError("merge: found one map, expected two or more");
  }
  if (!arguments.at.empty() && arguments.maps.size() > 2) {
    throw ConfigError(
        "--at: found it beside more than two maps, expected two; merge the others one by one");
  }
  ParseStart(arguments.at);
  for (const std::string& map : arguments.maps) ExpectFolder(map, FolderKind::kMap);
}

void Merge(const MergeArguments& arguments) {
  RefuseWrongMaps(arguments);
  MappingOptions options = OptionsOfMerging(arguments.config, arguments.maps.front());
  options.SetThreads(arguments.threads);
  std::vector<std::string> inputs = arguments.maps;
  if (!arguments.config.empty()) inputs.push_back(arguments.config);
  OutputFolder output(arguments.output, MapFiles(), inputs);
  MapResult merged = ReadMapToShow(arguments.maps.front(), arguments.accept_changed);
  const Progress progress = StageProgress("merge");
  const auto steps = static_cast<double>(arguments.maps.size() - 1);
  for (std::size_t i = 1; i < arguments.maps.size(); ++i) {
    const std::string& name = arguments.maps[i];
    MapResult next = ReadMapToShow(name, arguments.accept_changed);
    output.Open();
    const double step = static_cast<double>(i - 1);
    merged = MergeStage(std::move(merged), std::move(next), name, arguments.at, options,
                        progress.Part(step / steps, (step + 1) / steps));
  }
  WriteMapFolder(&output, merged);
  spdlog::info("wrote {}: {} poses, {} dense points, {} lines, {} rooms of {} runs", output.path(),
               merged.trajectory.size(), merged.dense.size(), merged.lines.size(),
               merged.building.rooms.size(), merged.source.merged.size());
}

}  // namespace

void AddMergeCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("merge", "Make one map of several of one building");
  const auto arguments = std::make_shared<MergeArguments>();
  command->add_option("maps", arguments->maps, "Map folders; the world is that of the first")
      ->type_name("MAP MAP...")
      ->required();
  command->add_option("-o,--output", arguments->output, "Map folder to write")
      ->type_name("MAP")
      ->required();
  AddStartOption(*command, &arguments->at);
  command->add_option("--config", arguments->config,
                      "YAML file whose section `mapping` overrides options (default: as the first "
                      "map was made)");
  command->add_option("--threads", arguments->threads, "Threads; the bytes are the same with any")
      ->capture_default_str();
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take files that are not as map wrote them, and a map of another run than "
                    "that beside it; values are checked in any case");
  command->footer(
      "Examples:\n  slcmap merge MONDAY/map TUESDAY/map -o BUILDING\n"
      "  slcmap merge GROUND/map FIRST/map -o BUILDING --at 12.5,-3,3.1,90\n\n"
      "How maps lie to each other is found by the lines and surfaces that both have. Where "
      "several\n"
      "places fit about as well, as in look-alike corridors, or they share too little, nothing is\n"
      "written and the exit code is 1; --at says about where the second lies.");
  command->callback([arguments] { Merge(*arguments); });
}

}  // namespace slcmap
