#include "export/web/gltf_writer.h"

#include <spdlog/fmt/fmt.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_layers.h"
#include "export/scene/meshes.h"
#include "export/scene/scene.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// A glTF 2.0 model that is built node by node.

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
  // What the scene is of, and where it lies: z is up there, as in the map.
  void SetOrigin(const MapScene& scene);

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
  void Use(const char* extension, bool required);

  bool quantised_;
  tinygltf::Model model_;
  std::vector<unsigned char> buffer_;
  std::map<std::string, int> nodes_;
  Eigen::AlignedBox3d box_;
};

namespace {

constexpr double kQuantisedSteps = 65535;  // of a quantised position

// glTF colours are linear, while those of the scene are as a screen shows them (sRGB).
uint8_t ToLinear(uint8_t value) {
  const double u = value / 255.0;
  const double linear = u <= 0.04045 ? u / 12.92 : std::pow((u + 0.055) / 1.055, 2.4);
  return static_cast<uint8_t>(std::lround(255 * linear));
}

Eigen::AlignedBox3d ComputeBox(const Vertices& vertices) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : vertices.positions) box.extend(position);
  return box;
}

}  // namespace

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
  const int index = NodeAt(path);
  tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
  tinygltf::Primitive primitive;
  primitive.mode = mode;
  primitive.material = UnlitMaterial();
  primitive.attributes["POSITION"] =
      quantised_ ? AddQuantised(vertices, &node) : AddPositions(vertices);
  primitive.attributes["COLOR_0"] = AddColours(vertices);
  if (!indices.empty()) primitive.indices = AddIndices(indices);
  tinygltf::Mesh mesh;
  mesh.name = path;
  mesh.primitives.push_back(primitive);
  node.mesh = static_cast<int>(model_.meshes.size());
  if (!extras.empty()) node.extras = tinygltf::Value(extras);
  model_.meshes.push_back(mesh);
}

void GltfModel::SetOrigin(const MapScene& scene) {
  if (scene.georeference) {
    const Georeference& place = *scene.georeference;
    tinygltf::Value::Object extras;
    tinygltf::Value::Array origin;
    for (const double value_m : place.origin_m) origin.emplace_back(value_m);
    extras["crs"] = tinygltf::Value(place.crs);
    extras["origin_m"] = tinygltf::Value(origin);
    extras["turn_rad"] = tinygltf::Value(place.turn_rad);
    extras["scale"] = tinygltf::Value(place.scale);
    model_.nodes[0].extras.Get<tinygltf::Value::Object>()["georeference"] = tinygltf::Value(extras);
  }
  if (scene.map_id.empty()) return;
  tinygltf::Value::Object ids;
  ids["map"] = tinygltf::Value(scene.map_id);
  ids["run"] = tinygltf::Value(scene.run_id);
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
  tinygltf::Mesh mesh;
  mesh.name = path;
  mesh.primitives.push_back(primitive);
  node.mesh = static_cast<int>(model_.meshes.size());
  model_.meshes.push_back(mesh);
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

namespace {

using Extras = tinygltf::Value::Object;

constexpr Colour kWallColour{222, 219, 211};
constexpr Colour kPlaneColour{200, 198, 192};

tinygltf::Value MakeValue(double value) { return tinygltf::Value(value); }
tinygltf::Value MakeValue(int64_t value) { return tinygltf::Value(static_cast<int>(value)); }
tinygltf::Value MakeValue(bool value) { return tinygltf::Value(value); }
tinygltf::Value MakeValue(const std::string& value) { return tinygltf::Value(value); }

template <typename T>
tinygltf::Value MakeArray(const std::vector<T>& values) {
  tinygltf::Value::Array array;
  for (const T& value : values) array.push_back(MakeValue(value));
  return tinygltf::Value(array);
}

std::string StoreyPath(const std::string& layer, const Building& building,
                       std::optional<std::size_t> storey) {
  if (!storey) return layer;
  return fmt::format("{}/storey {}", layer, building.storeys[*storey].id);
}

template <std::size_t N>
std::vector<uint32_t> Flat(const std::vector<std::array<uint32_t, N>>& groups) {
  std::vector<uint32_t> indices;
  for (const auto& group : groups) indices.insert(indices.end(), group.begin(), group.end());
  return indices;
}

// Lines of a map with their ids, kinds and standard deviations. Two vertices a line.
void AddLineGroup(const std::string& path, const MapResult& map,
                  const std::vector<std::size_t>& lines, GltfModel* model) {
  Vertices vertices;
  std::vector<int64_t> ids, kinds;
  std::vector<double> sigmas_m;
  for (const std::size_t i : lines) {
    const MapLine& line = map.lines[i];
    const auto [red, green, blue] = LineColour(line.axis, line.recent);
    for (const auto& end : {line.start_world, line.end_world})
      vertices.Add(end, {red, green, blue});
    ids.push_back(line.id);
    kinds.push_back(static_cast<int64_t>(line.kind));
    sigmas_m.push_back(line.sigma_m);
  }
  std::vector<uint32_t> indices(vertices.size());
  std::iota(indices.begin(), indices.end(), 0u);
  model->AddLayer(path, vertices, indices, TINYGLTF_MODE_LINE,
                  {{"axis", MakeValue(std::string(AxisName(map.lines[lines[0]].axis)))},
                   {"ids", MakeArray(ids)},
                   {"kinds", MakeArray(kinds)},
                   {"sigmas_m", MakeArray(sigmas_m)}});
}

// Fills a model with what a map and its scene hold.
class GltfLayers {
 public:
  GltfLayers(const MapResult& map, const MapScene& scene, GltfModel* model)
      : map_(map), scene_(scene), model_(model) {}

  void AddPoints() {
    for (const PointLayer& layer : scene_.points) {
      model_->AddLayer(layer.name, layer.vertices, {}, TINYGLTF_MODE_POINTS);
    }
  }

  // At most so many, one of every few.
  void AddDense(int64_t most) {
    const auto count = static_cast<int64_t>(CountDense(map_));
    if (most <= 0 || count == 0) return;
    const int64_t every = (count + most - 1) / most;
    Vertices vertices;
    for (int64_t i = 0; i < count; i += every) {
      const DensePoint& point = DenseAt(map_, static_cast<std::size_t>(i));
      vertices.Add(point.p_world, {point.grey, point.grey, point.grey});
    }
    model_->AddLayer("dense", vertices, {}, TINYGLTF_MODE_POINTS, {{"one_of", MakeValue(every)}});
  }

  void AddLines() {
    std::map<std::string, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < map_.lines.size(); ++i) {
      const MapLine& line = map_.lines[i];
      const double middle_m = 0.5 * (line.start_world.z() + line.end_world.z());
      const auto storey = StoreyAt(map_.building, middle_m);
      groups[StoreyPath("lines", map_.building, storey) + "/" + AxisName(line.axis)].push_back(i);
    }
    for (const auto& [path, lines] : groups) AddLineGroup(path, map_, lines, model_);
  }

  void AddTracks() {
    for (const LineLayer& layer : scene_.lines) {
      if (layer.name == "lines") continue;
      model_->AddLayer(layer.name, layer.vertices, Flat(layer.edges), TINYGLTF_MODE_LINE);
    }
  }

  void AddMeshes(const GltfOptions& options, const Progress& progress) {
    for (const MeshLayer& layer : scene_.meshes) {
      progress.ReportOrStop(0);
      if (layer.name == "line_bars" && !options.tubes) continue;
      if (layer.name == "voxels" && !options.voxels) continue;
      AddMesh(layer.name, layer, {});
    }
  }

  void AddPipes() {
    for (const MapPipe& pipe : map_.pipes) {
      MeshLayer mesh;
      AddTube(pipe, kPipeColour, &mesh);
      const double middle_m = 0.5 * (pipe.start_world.z() + pipe.end_world.z());
      const auto storey = StoreyAt(map_.building, middle_m);
      AddMesh(StoreyPath("pipes", map_.building, storey) + fmt::format("/pipe {}", pipe.id), mesh,
              {{"id", MakeValue(pipe.id)},
               {"kind", MakeValue(std::string("pipe"))},
               {"axis", MakeValue(std::string(AxisName(pipe.axis)))},
               {"radius_m", MakeValue(pipe.radius_m)},
               {"radius_sigma_m", MakeValue(pipe.radius_sigma_m)},
               {"sigma_m", MakeValue(pipe.sigma_m)}});
    }
  }

  void AddWalls() {
    const std::map<const PlanWall*, WallSolid> solids = SolidsOfWalls(map_.building);
    for (const PlanWall& wall : map_.building.walls) {
      const WallHeight height = HeightOfWall(wall, map_.building);
      MeshLayer mesh;
      const auto solid = solids.find(&wall);
      const WallBack back = solid == solids.end() ? WallBack() : ComputeBack(solid->second);
      AddWallMesh(wall, height, kWallColour, &mesh, back);
      const auto storey = StoreyOfId(map_.building, wall.storey);
      AddMesh(StoreyPath("walls", map_.building, storey) + fmt::format("/wall {}", wall.id), mesh,
              {{"id", MakeValue(wall.id)},
               {"kind", MakeValue(std::string("wall"))},
               {"thickness_m", MakeValue(wall.thickness_m)},
               {"thickness_assumed", MakeValue(wall.thickness_assumed)},
               {"height_assumed", MakeValue(height.assumed)},
               {"sigma_m", MakeValue(wall.sigma_m)},
               {"plane_ids", MakeArray(wall.plane_ids)}});
    }
  }

  // But those that walls are made of.
  void AddPlanes() {
    for (const BuildingPlane& plane : map_.building.planes) {
      if (IsOfWall(plane.id)) continue;
      MeshLayer mesh;
      AddPlaneMesh(plane, map_.building, kPlaneColour, &mesh);
      const auto storey = StoreyOfId(map_.building, plane.storey);
      AddMesh(StoreyPath("planes", map_.building, storey) + "/" + GetName(plane.kind) +
                  fmt::format("/plane {}", plane.id),
              mesh,
              {{"id", MakeValue(plane.id)},
               {"kind", MakeValue(std::string(GetName(plane.kind)))},
               {"sigma_m", MakeValue(plane.sigma_m)},
               {"inferred", MakeValue(plane.inferred)},
               {"room_ids", MakeArray(plane.room_ids)}});
    }
  }

  // Lifted off their planes, so that these do not shine through.
  void AddTextures(const std::vector<FaceTexture>& textures) {
    constexpr double kLift_m = 0.003;
    for (const FaceTexture& texture : textures) {
      const BuildingPlane& plane = map_.building.planes[static_cast<std::size_t>(texture.plane_id)];
      const Canvas& canvas = texture.canvas;
      Vertices vertices;
      std::vector<uint32_t> indices;
      std::vector<Eigen::Vector2f> places;
      for (const Polygon& part : AreaOn(canvas, plane, map_.building)) {
        for (const PlanTriangle& triangle : Triangulate(part)) {
          for (const Eigen::Vector2d& p : triangle) {
            indices.push_back(static_cast<uint32_t>(vertices.size()));
            vertices.Add(canvas.At(p) + kLift_m * canvas.Normal(), kPlaneColour);
            const Eigen::Vector2d share = p.cwiseQuotient(texture.size_m);
            places.push_back(Eigen::Vector2d(share.x(), 1 - share.y()).cast<float>());
          }
        }
      }
      const auto storey = StoreyOfId(map_.building, plane.storey);
      model_->AddTextured(StoreyPath("orthophotos", map_.building, storey) + "/" + texture.name,
                          vertices, indices, places, texture.png);
    }
  }

 private:
  void AddMesh(const std::string& path, const MeshLayer& layer, const Extras& extras) {
    model_->AddLayer(path, layer.vertices, Flat(layer.triangles), TINYGLTF_MODE_TRIANGLES, extras);
  }

  bool IsOfWall(int64_t plane_id) const {
    return std::any_of(map_.building.walls.begin(), map_.building.walls.end(),
                       [&](const PlanWall& wall) {
                         const std::vector<int64_t>& ids = wall.plane_ids;
                         return std::find(ids.begin(), ids.end(), plane_id) != ids.end();
                       });
  }

  const MapResult& map_;
  const MapScene& scene_;
  GltfModel* model_;
};

int64_t CountVertices(const MapScene& scene) {
  int64_t count = 0;
  for (const PointLayer& layer : scene.points) count += std::ssize(layer.vertices.positions);
  for (const LineLayer& layer : scene.lines) count += std::ssize(layer.vertices.positions);
  for (const MeshLayer& layer : scene.meshes) count += std::ssize(layer.vertices.positions);
  return count;
}

std::string GlbBytes(GltfModel* model) {
  const tinygltf::Model finished = model->Finish();
  std::ostringstream bytes;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&finished, bytes, false, true)) {
    throw OutputError("a model cannot be written as glTF");
  }
  return bytes.str();
}

}  // namespace

PartModel MakePointsModel(const std::string& name, const Vertices& vertices) {
  // In steps of half a millimetre or less, where 16 bits hold that.
  constexpr double kMostQuantised_m = 32;
  GltfModel model(ComputeBox(vertices).sizes().maxCoeff() <= kMostQuantised_m);
  model.AddLayer(name, vertices, {}, TINYGLTF_MODE_POINTS);
  return {GlbBytes(&model), model.box()};
}

PartModel MakeLinesModel(const MapResult& map, std::span<const std::size_t> lines) {
  std::map<LineAxis, std::vector<std::size_t>> by_axis;
  for (const std::size_t i : lines) by_axis[map.lines[i].axis].push_back(i);
  GltfModel model(false);
  for (const auto& [axis, some] : by_axis) {
    AddLineGroup(std::string("lines/") + AxisName(axis), map, some, &model);
  }
  return {GlbBytes(&model), model.box()};
}

PartModel MakeBuildingModel(const MapResult& map) {
  GltfModel model(false);
  const MapScene nothing_else;
  GltfLayers layers(map, nothing_else, &model);
  layers.AddPipes();
  layers.AddWalls();
  layers.AddPlanes();
  return {GlbBytes(&model), model.box()};
}

std::vector<std::string> GltfWriter::Write(const std::string& folder, const MapResult& map,
                                           const Progress& progress) const {
  const MapScene& scene = scene_->Of(map, progress.Part(0, 0.5));
  GltfModel model(options_.quantised);
  model.SetOrigin(scene);
  GltfLayers layers(map, scene, &model);
  layers.AddPoints();
  layers.AddDense(max_vertices_ - CountVertices(scene));
  progress.ReportOrStop(0.55);
  layers.AddLines();
  layers.AddTracks();
  layers.AddMeshes(options_, progress.Part(0.6, 0.7));
  layers.AddPipes();
  layers.AddWalls();
  layers.AddPlanes();
  if (textures_) layers.AddTextures(*textures_);
  progress.ReportOrStop(0.75);
  const std::string path = folder + "/scene.glb";
  const std::string bytes = GlbBytes(&model);
  progress.ReportOrStop(0.9);
  WriteFile(path, bytes);
  return {path};
}

}  // namespace slcmap::exporting
