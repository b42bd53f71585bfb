#include "apps/commands/external_maps.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "data/core/error.h"
#include "data/io/csv.h"

namespace slcmap::inline commands {
namespace {

// "a=b" of a map; a path alone is called as its file.
NamedMap ParseNamedMap(const std::string& text) {
  const size_t equals = text.find('=');
  NamedMap map;
  map.path = equals == std::string::npos ? text : text.substr(equals + 1);
  map.name = equals == std::string::npos
                 ? std::filesystem::weakly_canonical(text).filename().string()
                 : text.substr(0, equals);
  if (map.name.empty() || map.path.empty() || map.name.find(',') != std::string::npos) {
    throw ConfigError(fmt::format("--maps: found {}, expected NAME=FILE or NAME=FOLDER", text));
  }
  std::error_code error;
  if (!std::filesystem::exists(map.path, error)) {
    throw ConfigError(
        fmt::format("--maps: found nothing at {}, expected a file or a folder", map.path));
  }
  return map;
}

void SetScale(const std::string& text, std::vector<NamedMap>* maps) {
  const size_t equals = text.find('=');
  const auto scale =
      equals == std::string::npos ? std::nullopt : ParseNumber(text.substr(equals + 1));
  const auto map = std::find_if(maps->begin(), maps->end(), [&](const NamedMap& m) {
    return equals != std::string::npos && m.name == text.substr(0, equals);
  });
  if (map == maps->end() || !scale || !(*scale > 0 && *scale < 1e6)) {
    throw ConfigError(fmt::format(
        "--map-scale: found {}, expected NAME=S with the name of one of --maps and S in metres a "
        "unit, such as 0.001",
        text));
  }
  map->scale = *scale;
}

}  // namespace

CLI::Option* AddExternalMapOptions(CLI::App& command, ExternalMapArguments* arguments) {
  CLI::Option* maps = command.add_option(
      "--maps", arguments->maps,
      "Maps by any system, instead of trajectories: NAME=PATH of a PLY, OBJ, DXF, PCD or LAS file, "
      "of text (limap, Line3D++, points, segments), or of a folder (limap, a map of ours)");
  command
      .add_option("--true-map", arguments->truth,
                  "A laser scan or a mesh of the building, that the maps are laid on")
      ->needs(maps);
  command
      .add_flag("--as-they-are", arguments->as_they_are,
                "The maps are in the world of --true-map and stay where they are")
      ->needs(maps);
  command
      .add_option("--map-scale", arguments->scales,
                  "NAME=S: metres of a unit of that map, such as 0.001")
      ->needs(maps);
  command.add_option("--true-scale", arguments->true_scale, "Metres of a unit of --true-map")
      ->needs(maps)
      ->check(CLI::PositiveNumber);
  return maps;
}

MapsToMeasure CollectMaps(const ExternalMapArguments& arguments) {
  MapsToMeasure maps;
  std::set<std::string> names;
  for (const std::string& text : arguments.maps) {
    maps.maps.push_back(ParseNamedMap(text));
    if (names.insert(maps.maps.back().name).second) continue;
    throw ConfigError(fmt::format("--maps: found {} twice, expected different names: NAME=PATH",
                                  maps.maps.back().name));
  }
  for (const std::string& text : arguments.scales) SetScale(text, &maps.maps);
  maps.truth = arguments.truth;
  maps.true_scale = arguments.true_scale;
  maps.as_they_are = arguments.as_they_are;
  return maps;
}

std::vector<std::string> CollectFiles(const MapsToMeasure& maps) {
  std::vector<std::string> files;
  for (const NamedMap& map : maps.maps) files.push_back(map.path);
  if (!maps.truth.empty()) files.push_back(maps.truth);
  return files;
}

}  // namespace slcmap::commands
