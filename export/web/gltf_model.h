// A glTF 2.0 model that is built node by node. Include in .cc files only: tiny_gltf.h is large.
#pragma once

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "export/scene/scene.h"

namespace slcmap::inline exporting {

Eigen::AlignedBox3d ComputeBox(const Vertices& vertices);

// All data goes into the model's one buffer. Node 0 turns z up into glTF's y up; all others are
// under it.
class GltfModel {
 public:
  explicit GltfModel(bool quantised);

  // Adds a node at a path, as "lines/storey 0/vertical", and those above it that there are not,
  // with a mesh of the vertices; without indices they are drawn in their order. Nothing is added
  // where nothing would be drawn.
  void AddLayer(const std::string& path, const Vertices& vertices,
                const std::vector<uint32_t>& indices, int mode,
                const tinygltf::Value::Object& extras = {});
  // Adds a node whose triangles show an image by the places of their vertices on it, of which (0,
  // 0) is the upper left corner.
  void AddTextured(const std::string& path, const Vertices& vertices,
                   const std::vector<uint32_t>& indices, const std::vector<Eigen::Vector2f>& places,
                   const std::string& png);
  // What the map is of, and where it lies: z is up there, as in the map.
  void SetOrigin(const MapResult& map);

  // Of all vertices.
  const Eigen::AlignedBox3d& box() const { return box_; }

  // The model, which ends with it.
  tinygltf::Model Finish();

 private:
  int NodeAt(const std::string& path);
  int UnlitMaterial();
  int TextureMaterial(const std::string& name, const std::string& png);
  template <typename T>
  int AddAccessor(const std::vector<T>& values, int target, tinygltf::Accessor accessor,
                  std::size_t stride = 0);
  int AddPositions(const Vertices& vertices);
  int AddQuantised(const Vertices& vertices, tinygltf::Node* node);
  int AddColours(const Vertices& vertices);
  int AddIndices(const std::vector<uint32_t>& indices);
  void SetMesh(const tinygltf::Primitive& primitive, tinygltf::Node* node);
  void Use(const char* extension, bool required);

  bool quantised_;
  tinygltf::Model model_;
  std::vector<unsigned char> buffer_;
  std::map<std::string, int> nodes_;
  Eigen::AlignedBox3d box_;
};

}  // namespace slcmap::exporting
