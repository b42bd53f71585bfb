// Maps by other systems on the command line: which evaluate and compare measure.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/maps/measured_map.h"

namespace slcmap::inline commands {

struct ExternalMapArguments {
  std::vector<std::string> maps;  // NAME=PATH, or PATH
  std::string truth;
  double true_scale = 1;
  std::vector<std::string> scales;  // NAME=S
  bool as_they_are = false;
};

// Adds --maps, --true-map, --as-they-are, --map-scale and --true-scale; `arguments` must outlive
// the parsing. Returns --maps.
CLI::Option* AddExternalMapOptions(CLI::App& command, ExternalMapArguments* arguments);

// What these name. Throws ConfigError.
MapsToMeasure CollectMaps(const ExternalMapArguments& arguments);

// The files and folders that are read.
std::vector<std::string> CollectFiles(const MapsToMeasure& maps);

}  // namespace slcmap::commands
