#include "export/export.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/error.h"
#include "data/file.h"
#include "export/gltf_writer.h"
#include "export/ply_writer.h"
#include "export/scene_writer.h"

namespace slcmap {

std::vector<std::unique_ptr<SceneWriter>> MakeSceneWriters() {
  std::vector<std::unique_ptr<SceneWriter>> writers;
  writers.push_back(std::make_unique<GltfSceneWriter>());
  writers.push_back(std::make_unique<PlySceneWriter>());
  return writers;
}

std::vector<std::string> ExportFormats() {
  std::vector<std::string> formats;
  for (const auto& writer : MakeSceneWriters()) formats.push_back(writer->Format());
  return formats;
}

std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options) {
  const std::vector<std::string> known = ExportFormats();
  const std::vector<std::string>& wanted = options.formats.empty() ? known : options.formats;
  for (const std::string& format : wanted) {
    if (std::find(known.begin(), known.end(), format) != known.end()) continue;
    throw ConfigError(
        fmt::format("format: found '{}', expected one of {}", format, fmt::join(known, ", ")));
  }
  const MapScene scene = MakeScene(map, options.scene);
  MakeFolder(folder);
  std::vector<std::string> paths;
  for (const auto& writer : MakeSceneWriters()) {
    if (std::find(wanted.begin(), wanted.end(), writer->Format()) == wanted.end()) continue;
    const std::vector<std::string> written = writer->Write(folder, scene);
    paths.insert(paths.end(), written.begin(), written.end());
  }
  return paths;
}

}  // namespace slcmap
