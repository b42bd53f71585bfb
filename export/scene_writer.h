// The formats that coloured geometry can be written in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/progress.h"
#include "export/map_writer.h"
#include "export/scene.h"

namespace slcmap {

// Makes the scene of a map once, for all formats that are written from it.
class SceneOfMap {
 public:
  explicit SceneOfMap(const SceneOptions& options) : options_(options) {}

  // Throws what MakeScene does. Maps are told apart by their address.
  const MapScene& Of(const MapResult& map, const Progress& progress);

 private:
  SceneOptions options_;
  const MapResult* map_ = nullptr;
  MapScene scene_;
};

// Writes the scene of a map in one format.
class SceneWriter : public MapWriter {
 public:
  explicit SceneWriter(std::shared_ptr<SceneOfMap> scene) : scene_(std::move(scene)) {}

  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const final;

 protected:
  // As Write() of a map.
  virtual std::vector<std::string> WriteScene(const std::string& folder, const MapScene& scene,
                                              const Progress& progress) const = 0;

 private:
  std::shared_ptr<SceneOfMap> scene_;
};

}  // namespace slcmap
