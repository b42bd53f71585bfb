// slcmap map: the map of a run.
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands.h"
#include "mapping/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/run_folder.h"

namespace slcmap {
namespace {

struct MapArguments {
  std::string run, output, config;
};

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
  for (const auto& [kind, count] : run.warnings) reasons += fmt::format("; {}: {}", kind, count);
  spdlog::warn("{}: found no pose in the run, so the map is empty{}", folder, reasons);
}

void Map(const MapArguments& arguments) {
  const MappingOptions options =
      arguments.config.empty() ? MappingOptions() : MappingOptions::FromYaml(arguments.config);
  const OdometryRun run = ReadRunFolder(arguments.run);
  if (!run.complete) spdlog::warn("{}: the run is partial: {}", arguments.run, run.partial_reason);
  if (run.states.empty()) WarnOfNoPoses(arguments.run, run);
  if (const int ends = SegmentEnds(run); ends > 0) {
    spdlog::warn(
        "{}: the estimator lost itself {} times; the map behind each is shifted by what "
        "moved meanwhile",
        arguments.run, ends);
  }
  const MapResult map = BuildMap(run, options);
  WriteMapFolder(arguments.output, map);
  spdlog::info(
      "wrote {}: {} poses, {} points of {} landmarks, {} of {} lines, {} occupied voxels of "
      "{} m",
      arguments.output, map.trajectory.size(), map.points.size(), run.landmarks.size(),
      map.lines.size(), run.lines.size(), map.occupancy.OccupiedVoxels().size(),
      map.occupancy.resolution_m());
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
  command->footer("Example:\n  slcmap map OUT/run -o OUT/map");
  command->callback([arguments] { Map(*arguments); });
}

}  // namespace slcmap
