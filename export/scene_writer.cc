#include "export/scene_writer.h"

namespace slcmap {

const MapScene& SceneOfMap::Of(const MapResult& map, const Progress& progress) {
  if (map_ == &map) return scene_;
  scene_ = MakeScene(map, options_, progress);
  scene_.map_id = map.id;
  scene_.run_id = map.source.run_id;
  map_ = &map;
  return scene_;
}

std::vector<std::string> SceneWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  const MapScene& scene = scene_->Of(map, progress.Part(0, 0.5));
  return WriteScene(folder, scene, progress.Part(0.5, 1));
}

}  // namespace slcmap
