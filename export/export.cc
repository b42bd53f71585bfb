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

StageFiles ExportFiles() {
  return {"an export",
          {"export.json", "scene.glb", "points.ply", "lines.ply", "trajectory.ply", "keyframes.ply",
           "voxels.ply", "line_bars.ply"}};
}

void CheckFormats(const ExportOptions& options) {
  const std::vector<std::string> known = ExportFormats();
  for (const std::string& format : options.formats) {
    if (std::find(known.begin(), known.end(), format) != known.end()) continue;
    throw ConfigError(
        fmt::format("format: found '{}', expected one of {}", format, fmt::join(known, ", ")));
  }
}

std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options) {
  CheckFormats(options);
  OutputFolder output(folder, ExportFiles());
  return ExportMap(map, &output, options);
}

std::vector<std::string> ExportMap(const MapResult& map, OutputFolder* folder,
                                   const ExportOptions& options) {
  CheckFormats(options);
  const std::vector<std::string>& wanted = options.formats;
  const MapScene scene = MakeScene(map, options.scene);
  std::vector<std::string> paths;
  for (const auto& writer : MakeSceneWriters()) {
    const bool is_wanted =
        wanted.empty() || std::find(wanted.begin(), wanted.end(), writer->Format()) != wanted.end();
    if (!is_wanted) continue;
    for (const std::string& path : writer->Write(folder->staging(), scene)) {
      paths.push_back(folder->path() + path.substr(folder->staging().size()));
    }
  }
  folder->Commit();
  return paths;
}

}  // namespace slcmap
