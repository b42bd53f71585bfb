// One binary glTF 2.0 file, for browsers, Blender, f3d and most viewers.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "export/scene/options.h"
#include "export/scene/plane_canvas.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {

// Writes scene.glb under a root node that turns z up into glTF's y up: the points, the dense cloud,
// the lines by storey and axis, trajectory, keyframes and, on request, voxels, walls as solids that
// meet at corners, with their openings, and other planes by kind, with ids, kinds and what is known
// of each in `extras`. Materials are unlit (KHR_materials_unlit) and colours are vertex colours of
// 8 bits. Empty layers are left out. With what the scene has, there are at most
// SceneOptions::max_vertices: dense points beyond are thinned.
class GltfWriter : public MapWriter {
 public:
  // `textures` are looked at when it writes; they become the layer "orthophotos", just before the
  // walls and floors that they are of.
  GltfWriter(std::shared_ptr<SceneOfMap> scene, int max_vertices, const GltfOptions& options,
             std::shared_ptr<const std::vector<FaceTexture>> textures = nullptr)
      : scene_(std::move(scene)),
        max_vertices_(max_vertices),
        options_(options),
        textures_(std::move(textures)) {}
  std::string Format() const override { return "glb"; }
  std::vector<std::string> Names() const override { return {"scene.glb"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  std::shared_ptr<SceneOfMap> scene_;
  int max_vertices_;
  GltfOptions options_;
  std::shared_ptr<const std::vector<FaceTexture>> textures_;
};

// Parts of a map as GLB files of their own, as scene.glb has them.

struct PartModel {
  std::string bytes;
  Eigen::AlignedBox3d box;  // of its vertices, z up; empty of a part without any
};

// Throw OutputError.
PartModel MakePointsModel(const std::string& name, const Vertices& vertices);
PartModel MakeLinesModel(const MapResult& map, std::span<const std::size_t> lines);  // of these
PartModel MakeBuildingModel(const MapResult& map);  // walls, other planes and pipes

}  // namespace slcmap::exporting
