// From a map to files that other programs show.
#pragma once

#include <string>
#include <vector>

#include "export/scene.h"
#include "mapping/map.h"

namespace slcmap {

struct ExportOptions {
  std::vector<std::string> formats;  // empty: all there are
  SceneOptions scene;
};

// The names of the formats there are.
std::vector<std::string> ExportFormats();

// Writes a map into a folder, which is made where it is missing, and returns the files' paths.
// Throws ConfigError for a format that there is not, and OutputError naming the file that cannot be
// written.
std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options);

}  // namespace slcmap
