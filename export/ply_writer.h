// A PLY file a layer, for MeshLab, CloudCompare, Blender and Open3D.
#pragma once

#include "export/ply_options.h"
#include "export/scene_writer.h"

namespace slcmap {

// Writes NAME.ply for each layer: coloured vertices, and edges (vertex1, vertex2) or triangles
// between them. Empty layers are written too, so that no file of an earlier export is left.
class PlySceneWriter : public SceneWriter {
 public:
  explicit PlySceneWriter(std::shared_ptr<SceneOfMap> scene, const PlyOptions& options = {})
      : SceneWriter(std::move(scene)), options_(options) {}
  std::string Format() const override { return "ply"; }
  std::vector<std::string> Names() const override;

 protected:
  std::vector<std::string> WriteScene(const std::string& folder, const MapScene& scene,
                                      const Progress& progress) const override;

 private:
  const PlyOptions options_;
};

}  // namespace slcmap
