#include "export/web/gltf_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "data/core/error.h"

namespace slcmap::inline exporting {

namespace {

constexpr double kQuantisedSteps = 65535;  // of a quantised position

// glTF colours are linear, while those of the scene are as a screen shows them (sRGB).
uint8_t ToLinear(uint8_t value) {
  const double u = value / 255.0;
  const double linear = u <= 0.04045 ? u / 12.92 : std::pow((u + 0.055) / 1.055, 2.4);
  return static_cast<uint8_t>(std::lround(255 * linear));
}

}  // namespace

Eigen::AlignedBox3d ComputeBox(const Vertices& vertices) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : vertices.positions) box.extend(position);
  return box;
}

GltfModel::GltfModel(bool quantised) : quantised_(quantised) {
  model_.asset.version = "2.0";
  model_.asset.generator = "slcmap";
  tinygltf::Node root;
  root.name = "world, z up, metres";
  root.rotation = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  root.extras = tinygltf::Value(tinygltf::Value::Object{
      {"unit", tinygltf::Value(std::string("metre"))}, {"up", tinygltf::Value(std::string("z"))}});
  model_.nodes.push_back(root);
  tinygltf::Scene scene;
  scene.nodes = {0};
  model_.scenes.push_back(scene);
  model_.defaultScene = 0;
}

int GltfModel::NodeAt(const std::string& path) {
  if (path.empty()) return 0;
  const auto known = nodes_.find(path);
  if (known != nodes_.end()) return known->second;
  const std::size_t slash = path.rfind('/');
  const int parent = NodeAt(slash == std::string::npos ? "" : path.substr(0, slash));
  const int node = static_cast<int>(model_.nodes.size());
  model_.nodes.emplace_back().name = path;
  model_.nodes[static_cast<std::size_t>(parent)].children.push_back(node);
  return nodes_[path] = node;
}

void GltfModel::AddLayer(const std::string& path, const Vertices& vertices,
                         const std::vector<uint32_t>& indices, int mode,
                         const tinygltf::Value::Object& extras) {
  if (vertices.size() == 0 || (mode != TINYGLTF_MODE_POINTS && indices.empty())) return;
  box_.extend(ComputeBox(vertices));
  tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(NodeAt(path))];
  tinygltf::Primitive primitive;
  primitive.mode = mode;
  primitive.material = UnlitMaterial();
  primitive.attributes["POSITION"] =
      quantised_ ? AddQuantised(vertices, &node) : AddPositions(vertices);
  primitive.attributes["COLOR_0"] = AddColours(vertices);
  if (!indices.empty()) primitive.indices = AddIndices(indices);
  if (!extras.empty()) node.extras = tinygltf::Value(extras);
  SetMesh(primitive, &node);
}

void GltfModel::SetMesh(const tinygltf::Primitive& primitive, tinygltf::Node* node) {
  tinygltf::Mesh mesh;
  mesh.name = node->name;
  mesh.primitives.push_back(primitive);
  node->mesh = static_cast<int>(model_.meshes.size());
  model_.meshes.push_back(mesh);
}

void GltfModel::SetOrigin(const MapResult& map) {
  if (map.source.georeference) {
    const Georeference& place = *map.source.georeference;
    tinygltf::Value::Object extras;
    tinygltf::Value::Array origin;
    for (const double value_m : place.origin_m) origin.emplace_back(value_m);
    extras["crs"] = tinygltf::Value(place.crs);
    extras["origin_m"] = tinygltf::Value(origin);
    extras["turn_rad"] = tinygltf::Value(place.turn_rad);
    extras["scale"] = tinygltf::Value(place.scale);
    model_.nodes[0].extras.Get<tinygltf::Value::Object>()["georeference"] = tinygltf::Value(extras);
  }
  if (map.id.empty()) return;
  tinygltf::Value::Object ids;
  ids["map"] = tinygltf::Value(map.id);
  ids["run"] = tinygltf::Value(map.source.run_id);
  model_.asset.extras = tinygltf::Value(ids);
}

tinygltf::Model GltfModel::Finish() {
  // A buffer must not be empty.
  if (!buffer_.empty()) {
    tinygltf::Buffer buffer;
    buffer.data = std::move(buffer_);
    model_.buffers.push_back(std::move(buffer));
  }
  return std::move(model_);
}

void GltfModel::Use(const char* extension, bool required) {
  std::vector<std::string>& used = model_.extensionsUsed;
  if (std::find(used.begin(), used.end(), extension) != used.end()) return;
  used.push_back(extension);
  if (required) model_.extensionsRequired.push_back(extension);
}

void GltfModel::AddTextured(const std::string& path, const Vertices& vertices,
                            const std::vector<uint32_t>& indices,
                            const std::vector<Eigen::Vector2f>& places, const std::string& png) {
  if (indices.empty()) return;
  tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(NodeAt(path))];
  std::vector<std::array<float, 2>> rows;
  for (const Eigen::Vector2f& place : places) rows.push_back({place.x(), place.y()});
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.type = TINYGLTF_TYPE_VEC2;
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.attributes["POSITION"] =
      quantised_ ? AddQuantised(vertices, &node) : AddPositions(vertices);
  primitive.attributes["TEXCOORD_0"] = AddAccessor(rows, TINYGLTF_TARGET_ARRAY_BUFFER, accessor);
  primitive.indices = AddIndices(indices);
  primitive.material = TextureMaterial(path, png);
  SetMesh(primitive, &node);
}

namespace {

tinygltf::Material MakeUnlit(const std::string& name) {
  tinygltf::Material material;
  material.name = name;
  material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
  // For viewers that do not know the extension.
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 1;
  return material;
}

}  // namespace

int GltfModel::UnlitMaterial() {
  if (!model_.materials.empty()) return 0;  // the first that was added
  model_.materials.push_back(MakeUnlit("unlit"));
  Use("KHR_materials_unlit", false);
  return 0;
}

int GltfModel::TextureMaterial(const std::string& name, const std::string& png) {
  UnlitMaterial();
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = buffer_.size();
  view.byteLength = png.size();
  buffer_.insert(buffer_.end(), png.begin(), png.end());
  buffer_.resize((buffer_.size() + 3) / 4 * 4);
  tinygltf::Image image;
  image.name = name;
  image.mimeType = "image/png";
  image.bufferView = static_cast<int>(model_.bufferViews.size());
  model_.bufferViews.push_back(view);
  tinygltf::Sampler sampler;
  sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
  if (model_.samplers.empty()) model_.samplers.push_back(sampler);
  tinygltf::Texture texture;
  texture.sampler = 0;
  texture.source = static_cast<int>(model_.images.size());
  model_.images.push_back(image);
  tinygltf::Material material = MakeUnlit(name);
  material.alphaMode = "MASK";
  material.pbrMetallicRoughness.baseColorTexture.index = static_cast<int>(model_.textures.size());
  model_.textures.push_back(texture);
  model_.materials.push_back(material);
  return static_cast<int>(model_.materials.size()) - 1;
}

template <typename T>
int GltfModel::AddAccessor(const std::vector<T>& values, int target, tinygltf::Accessor accessor,
                           std::size_t stride) {
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = buffer_.size();  // stays a multiple of 4: all values are
  view.byteLength = values.size() * sizeof(T);
  view.byteStride = stride;
  view.target = target;
  buffer_.resize(buffer_.size() + view.byteLength);
  std::memcpy(buffer_.data() + view.byteOffset, values.data(), view.byteLength);
  accessor.bufferView = static_cast<int>(model_.bufferViews.size());
  accessor.count = values.size();
  model_.bufferViews.push_back(view);
  model_.accessors.push_back(accessor);
  return static_cast<int>(model_.accessors.size()) - 1;
}

int GltfModel::AddPositions(const Vertices& vertices) {
  std::vector<std::array<float, 3>> positions;
  for (const Eigen::Vector3d& position : vertices.positions) {
    const Eigen::Vector3f p = position.cast<float>();
    positions.push_back({p.x(), p.y(), p.z()});
  }
  const Eigen::AlignedBox3d box = ComputeBox(vertices);
  const Eigen::Vector3f low = box.min().cast<float>(), high = box.max().cast<float>();
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.type = TINYGLTF_TYPE_VEC3;
  accessor.minValues = {low.x(), low.y(), low.z()};
  accessor.maxValues = {high.x(), high.y(), high.z()};
  return AddAccessor(positions, TINYGLTF_TARGET_ARRAY_BUFFER, accessor);
}

int GltfModel::AddQuantised(const Vertices& vertices, tinygltf::Node* node) {
  Use("KHR_mesh_quantization", true);
  const Eigen::AlignedBox3d box = ComputeBox(vertices);
  const double extent_m = box.sizes().maxCoeff();
  const double step_m = extent_m > 0 ? extent_m / kQuantisedSteps : 1;
  const auto steps = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(((p - box.min()) / step_m).array().round());
  };
  std::vector<std::array<uint16_t, 4>> positions;  // the last is there for the alignment
  for (const Eigen::Vector3d& position : vertices.positions) {
    const Eigen::Vector3d p = steps(position);
    positions.push_back({static_cast<uint16_t>(p.x()), static_cast<uint16_t>(p.y()),
                         static_cast<uint16_t>(p.z()), 0});
  }
  node->translation = {box.min().x(), box.min().y(), box.min().z()};
  node->scale = {step_m, step_m, step_m};
  const Eigen::Vector3d high = steps(box.max());
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
  accessor.type = TINYGLTF_TYPE_VEC3;
  accessor.minValues = {0, 0, 0};
  accessor.maxValues = {high.x(), high.y(), high.z()};
  return AddAccessor(positions, TINYGLTF_TARGET_ARRAY_BUFFER, accessor, sizeof positions[0]);
}

int GltfModel::AddColours(const Vertices& vertices) {
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

int GltfModel::AddIndices(const std::vector<uint32_t>& indices) {
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  accessor.type = TINYGLTF_TYPE_SCALAR;
  return AddAccessor(indices, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, accessor);
}

}  // namespace slcmap::exporting
