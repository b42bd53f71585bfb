// One binary glTF 2.0 file, for browsers, Blender, f3d and most viewers.
#pragma once

#include "export/scene_writer.h"

namespace slcmap {

// Writes scene.glb: a node a layer under a root node that turns z up into glTF's y up. Materials
// are unlit (KHR_materials_unlit) and colours are vertex colours of 8 bits. Empty layers are left
// out.
class GltfSceneWriter : public SceneWriter {
 public:
  using SceneWriter::SceneWriter;
  std::string Format() const override { return "glb"; }
  std::vector<std::string> Names() const override { return {"scene.glb"}; }

 protected:
  std::vector<std::string> WriteScene(const std::string& folder, const MapScene& scene,
                                      const Progress& progress) const override;
};

}  // namespace slcmap
