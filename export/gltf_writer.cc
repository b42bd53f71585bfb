#include "export/gltf_writer.h"

#include <tiny_gltf.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

// glTF colours are linear, while those of the scene are as a screen shows them (sRGB).
uint8_t ToLinear(uint8_t value) {
  const double u = value / 255.0;
  const double linear = u <= 0.04045 ? u / 12.92 : std::pow((u + 0.055) / 1.055, 2.4);
  return static_cast<uint8_t>(std::lround(255 * linear));
}

// Builds a glTF model layer by layer; all data goes into its one buffer.
class ModelBuilder {
 public:
  ModelBuilder() {
    model_.asset.version = "2.0";
    model_.asset.generator = "slcmap";
    tinygltf::Node root;
    root.name = "world, z up, metres";
    root.rotation = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    model_.nodes.push_back(root);
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(scene);
    model_.defaultScene = 0;
  }

  // Adds a node with a mesh of the vertices; without indices they are drawn in their order.
  void AddLayer(const std::string& name, const Vertices& vertices,
                const std::vector<uint32_t>& indices, int mode) {
    if (vertices.size() == 0 || (mode != TINYGLTF_MODE_POINTS && indices.empty())) return;
    tinygltf::Primitive primitive;
    primitive.mode = mode;
    primitive.material = UnlitMaterial();
    primitive.attributes["POSITION"] = AddPositions(vertices);
    primitive.attributes["COLOR_0"] = AddColours(vertices);
    if (!indices.empty()) primitive.indices = AddIndices(indices);
    tinygltf::Mesh mesh;
    mesh.name = name;
    mesh.primitives.push_back(primitive);
    tinygltf::Node node;
    node.name = name;
    node.mesh = static_cast<int>(model_.meshes.size());
    model_.meshes.push_back(mesh);
    model_.nodes[0].children.push_back(static_cast<int>(model_.nodes.size()));
    model_.nodes.push_back(node);
  }

  void SetOrigin(const std::string& map_id, const std::string& run_id) {
    if (map_id.empty()) return;
    tinygltf::Value::Object ids;
    ids["map"] = tinygltf::Value(map_id);
    ids["run"] = tinygltf::Value(run_id);
    model_.asset.extras = tinygltf::Value(ids);
  }

  tinygltf::Model Finish() {
    // A buffer must not be empty.
    if (!buffer_.empty()) {
      tinygltf::Buffer buffer;
      buffer.data = std::move(buffer_);
      model_.buffers.push_back(std::move(buffer));
    }
    return std::move(model_);
  }

 private:
  int UnlitMaterial() {
    if (!model_.materials.empty()) return 0;
    tinygltf::Material material;
    material.name = "unlit";
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    // For viewers that do not know the extension.
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.pbrMetallicRoughness.roughnessFactor = 1;
    model_.materials.push_back(material);
    model_.extensionsUsed = {"KHR_materials_unlit"};
    return 0;
  }

  template <typename T>
  int AddAccessor(const std::vector<T>& values, int target, tinygltf::Accessor accessor) {
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = buffer_.size();  // stays a multiple of 4: all values are
    view.byteLength = values.size() * sizeof(T);
    view.target = target;
    buffer_.resize(buffer_.size() + view.byteLength);
    std::memcpy(buffer_.data() + view.byteOffset, values.data(), view.byteLength);
    accessor.bufferView = static_cast<int>(model_.bufferViews.size());
    accessor.count = values.size();
    model_.bufferViews.push_back(view);
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  int AddPositions(const Vertices& vertices) {
    std::vector<std::array<float, 3>> positions;
    Eigen::Vector3f low = vertices.positions.front().cast<float>(), high = low;
    for (const Eigen::Vector3d& position : vertices.positions) {
      const Eigen::Vector3f p = position.cast<float>();
      positions.push_back({p.x(), p.y(), p.z()});
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    accessor.type = TINYGLTF_TYPE_VEC3;
    accessor.minValues = {low.x(), low.y(), low.z()};
    accessor.maxValues = {high.x(), high.y(), high.z()};
    return AddAccessor(positions, TINYGLTF_TARGET_ARRAY_BUFFER, accessor);
  }

  int AddColours(const Vertices& vertices) {
    std::vector<std::array<uint8_t, 4>> colours;
    for (const Colour& c : vertices.colours) {
      colours.push_back({ToLinear(c.red), ToLinear(c.green), ToLinear(c.blue), 255});
    }
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    accessor.type = TINYGLTF_TYPE_VEC4;
    accessor.normalized = true;
    return AddAccessor(colours, TINYGLTF_TARGET_ARRAY_BUFFER, accessor);
  }

  int AddIndices(const std::vector<uint32_t>& indices) {
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    accessor.type = TINYGLTF_TYPE_SCALAR;
    return AddAccessor(indices, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, accessor);
  }

  tinygltf::Model model_;
  std::vector<unsigned char> buffer_;
};

template <std::size_t N>
std::vector<uint32_t> Flat(const std::vector<std::array<uint32_t, N>>& groups) {
  std::vector<uint32_t> indices;
  for (const auto& group : groups) indices.insert(indices.end(), group.begin(), group.end());
  return indices;
}

}  // namespace

std::vector<std::string> GltfSceneWriter::WriteScene(const std::string& folder, const MapScene& scene,
                                                const Progress& progress) const {
  ModelBuilder builder;
  builder.SetOrigin(scene.map_id, scene.run_id);
  for (const PointLayer& layer : scene.points) {
    builder.AddLayer(layer.name, layer.vertices, {}, TINYGLTF_MODE_POINTS);
  }
  progress.ReportOrStop(0.1);
  for (const LineLayer& layer : scene.lines) {
    builder.AddLayer(layer.name, layer.vertices, Flat(layer.edges), TINYGLTF_MODE_LINE);
  }
  for (const MeshLayer& layer : scene.meshes) {
    progress.ReportOrStop(0.2);
    builder.AddLayer(layer.name, layer.vertices, Flat(layer.triangles), TINYGLTF_MODE_TRIANGLES);
  }
  progress.ReportOrStop(0.5);
  const tinygltf::Model model = builder.Finish();
  const std::string path = folder + "/scene.glb";
  std::ostringstream bytes;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model, bytes, false, true)) {
    throw OutputError(path + ": cannot be written as glTF");
  }
  progress.ReportOrStop(0.8);
  WriteFile(path, bytes.str());
  return {path};
}

}  // namespace slcmap
