// slcmap merge: maps of one building as one.
#include <spdlog/spdlog.h>

#include <memory>
#include <opencv2/core/utility.hpp>

#include "apps/commands/commands.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/place_stage.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/output_folder.h"
#include "mapping/align/map_agreement.h"
#include "mapping/align/merge_maps.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"

namespace slcmap::inline commands {
namespace {

struct MergeArguments {
  std::vector<std::string> maps;
  std::string output, at, config, placed;
  int threads = 2;
  bool accept_changed = false;
};

void RefuseWrongMaps(const MergeArguments& arguments) {
  CheckThreads(arguments.threads);
  if (arguments.maps.size() < 2) {
    throw ConfigError("merge: found one map, expected two or more");
  }
  if (!arguments.at.empty() && !arguments.placed.empty()) {
    throw ConfigError("--at: found it beside --placed, expected one of them");
  }
  if (!arguments.at.empty() && arguments.maps.size() > 2) {
    throw ConfigError(
        "--at: found it beside more than two maps, expected two; merge the others one by one");
  }
  ParseStart("--at", 3, arguments.at);
  for (const std::string& map : arguments.maps) ExpectFolder(map, FolderKind::kMap);
}

// Those that lie with the first; of the others it is told why they do not.
std::vector<std::size_t> ListOfFirst(const std::vector<MapFolder>& folders,
                                     const MapPlacement& placement) {
  std::vector<std::size_t> of_first;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (placement.maps[i].group == 0) of_first.push_back(i);
  }
  for (const PairApart& pair : placement.apart) {
    const bool is_told =
        (placement.maps[pair.first].group == 0) != (placement.maps[pair.second].group == 0);
    const std::string words = fmt::format("{} and {}: {}", folders[pair.first].name,
                                          folders[pair.second].name, pair.reason);
    if (of_first.size() < 2 && is_told) throw DataError(words);
    spdlog::warn("{}{}", words, is_told ? "; they stay apart" : "");
  }
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (placement.maps[i].group == 0) continue;
    spdlog::warn("{}: left out, as it has no place that is sure", folders[i].name);
  }
  return of_first;
}

void LogAlignment(const std::string& name, const MapAlignment& found) {
  const Eigen::Vector3d& p = found.T_first_second.translation;
  spdlog::info(
      "{}: lies at {:.3f}, {:.3f}, {:.3f} m, turned by {:.2f} degrees; {:.0f} m2 of surfaces and "
      "{:.0f} m of lines agree, {:.1f} % of the surfaces contradict, the next best place explains "
      "{:.0f} % as much of what tells the two apart",
      name, p.x(), p.y(), p.z(), ComputeYaw(found.T_first_second) / kDegree, found.surfaces_m2,
      found.lines_m, 100 * found.contradiction, 100 * found.rival_share);
}

// Of the second map in the first, about where --at says.
RigidTransform AlignFromStart(const MergeArguments& arguments, const Progress& progress) {
  const AlignmentOptions options{ParseStart("--at", 3, arguments.at)};
  try {
    const auto read = [&](std::size_t i) {
      return PrepareToUnite(ReadMapToShow(arguments.maps[i], arguments.accept_changed)).map;
    };
    const MapAlignment found = AlignMaps(read(0), read(1), options, progress);
    LogAlignment(arguments.maps[1], found);
    return found.T_first_second;
  } catch (const DataError& error) {
    throw DataError(arguments.maps[1] + ": " + error.what());
  }
}

// As a file says, or by what the maps have in common. In the world of the first map.
std::vector<MapToMerge> PlaceMapsToMerge(const MergeArguments& arguments,
                                         const Progress& progress) {
  std::vector<MapFolder> folders;
  for (const std::string& map : arguments.maps) folders.push_back({map, map});
  const auto read = [&](std::size_t i) {
    return [path = folders[i].path, accept = arguments.accept_changed] {
      return ReadMapToShow(path, accept);
    };
  };
  std::vector<MapToMerge> maps;
  if (!arguments.at.empty()) {
    maps = {{read(0), {}}, {read(1), AlignFromStart(arguments, progress)}};
  } else if (!arguments.placed.empty()) {
    for (std::size_t i = 0; i < folders.size(); ++i) {
      const FolderPlace place = FindPlaceOfFolder(arguments.placed, folders[i].path);
      maps.push_back({read(i), place.T_group_map, place.date});
    }
  } else {
    const PlacedFolders placed = PlaceFolders(folders, arguments.accept_changed, "", progress);
    for (const std::size_t i : ListOfFirst(folders, placed.placement)) {
      maps.push_back({read(i), placed.placement.maps[i].T_group_map});
    }
  }
  const RigidTransform T_first_group = maps.front().T_world_map.Inverse();
  for (MapToMerge& map : maps) map.T_world_map = T_first_group * map.T_world_map;
  return maps;
}

MapResult MergeAll(const MergeArguments& arguments, const MappingOptions& options,
                   const Progress& progress) {
  constexpr double kPlaced = 0.5;  // share of the time, about
  const std::vector<MapToMerge> maps = PlaceMapsToMerge(arguments, progress.Part(0, kPlaced));
  MapResult merged = MergeMaps(maps, options, progress.Part(kPlaced, 1));
  const std::size_t left_out = arguments.maps.size() - maps.size();
  if (left_out > 0) merged.warnings["maps_left_out"] += static_cast<int64_t>(left_out);
  return merged;
}

// Of a file, or without one those that the first map was made with.
MappingOptions OptionsOfMerging(const std::string& config, const std::string& first_map) {
  if (!config.empty()) return MappingOptions::FromYaml(config);
  try {
    return MappingOptions::FromYaml(first_map + "/options.yaml", ConfigOrigin::kKept);
  } catch (const ConfigError& error) {
    throw ConfigError(std::string(error.what()) +
                      "; of a map by another version --config can stand for its options");
  }
}

void Merge(const MergeArguments& arguments) {
  RefuseWrongMaps(arguments);
  const MappingOptions options = OptionsOfMerging(arguments.config, arguments.maps.front());
  cv::setNumThreads(arguments.threads);
  std::vector<std::string> inputs = arguments.maps;
  for (const std::string& file : {arguments.config, arguments.placed}) {
    if (!file.empty()) inputs.push_back(file);
  }
  OutputFolder output(arguments.output, MapFiles(), inputs);
  output.Open();
  const MapResult merged = MergeAll(arguments, options, StageProgress("merge"));
  WriteMapFolder(&output, merged);
  spdlog::info("wrote {}: {} poses, {} dense points, {} lines, {} rooms of {} runs", output.path(),
               merged.trajectory.size(), CountDense(merged), merged.lines.size(),
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
  command
      ->add_option("--at", arguments->at,
                   "Rough place of the second map's origin in the first one's world, and its "
                   "turn about z: looked for within 2 m, 1 m of height and 20 degrees of it")
      ->type_name("X,Y,Z,YAW_DEG");
  command
      ->add_option("--placed", arguments->placed,
                   "Where maps lie, as batch writes it: not looked for")
      ->group("");
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
      "How maps lie to each other is found by the lines and surfaces that they have in common; of\n"
      "many, pairs that are likely to overlap are compared, and have to agree. Those that share\n"
      "nothing lie as their control points say. Where several places fit about as well, as in\n"
      "look-alike corridors, maps are left out, with the reason, and where none is left to merge,\n"
      "the exit code is 1; --at says about where the second of two lies.");
  command->callback([arguments] { Merge(*arguments); });
}

}  // namespace slcmap::commands
