#include <spdlog/fmt/fmt.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/scene/building_solids.h"
#include "export/scene/formats.h"
#include "export/scene/map_layers.h"
#include "export/scene/meshes.h"
#include "export/scene/scene.h"
#include "export/web/cloud_tiles.h"
#include "export/web/gltf_model.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

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

  void AddPoints() { model_->AddLayer("points", scene_.points, {}, TINYGLTF_MODE_POINTS); }

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
      const auto storey = StoreyAtMiddle(map_.building, line);
      groups[StoreyPath("lines", map_.building, storey) + "/" + AxisName(line.axis)].push_back(i);
    }
    for (const auto& [path, lines] : groups) AddLineGroup(path, map_, lines, model_);
  }

  void AddTracks() {
    for (const auto& [name, layer] :
         {std::pair("trajectory", &scene_.trajectory), std::pair("keyframes", &scene_.keyframes)}) {
      model_->AddLayer(name, layer->vertices, Flat(layer->edges), TINYGLTF_MODE_LINE);
    }
  }

  void AddMeshes(const GltfOptions& options) {
    if (options.voxels) AddMesh("voxels", scene_.voxels, {});
    if (options.tubes) AddMesh("line_bars", scene_.line_bars, {});
  }

  void AddPipes() {
    for (const MapPipe& pipe : map_.pipes) {
      MeshLayer mesh;
      AddTube(pipe, kPipeColour, &mesh);
      const auto storey = StoreyAtMiddle(map_.building, pipe);
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
      AddWallMesh(wall, height, kWallColour, &mesh, ComputeBack(wall, solids));
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

std::vector<std::string> WriteGlb(const GltfOptions& options, int max_vertices,
                                  const std::shared_ptr<SceneOfMap>& scene_of_map,
                                  const std::shared_ptr<std::vector<FaceTexture>>& textures,
                                  const std::string& folder, const MapResult& map,
                                  const Progress& progress) {
  const MapScene& scene = scene_of_map->Get(map, progress.Part(0, 0.5));
  GltfModel model(options.quantised);
  model.SetOrigin(map);
  GltfLayers layers(map, scene, &model);
  layers.AddPoints();
  layers.AddDense(max_vertices - scene.CountVertices());
  progress.ReportOrStop(0.55);
  layers.AddLines();
  layers.AddTracks();
  progress.ReportOrStop(0.6);
  layers.AddMeshes(options);
  layers.AddPipes();
  layers.AddWalls();
  layers.AddPlanes();
  if (textures) layers.AddTextures(*textures);
  progress.ReportOrStop(0.75);
  const std::string path = folder + "/scene.glb";
  const std::string bytes = GlbBytes(&model);
  progress.ReportOrStop(0.9);
  WriteFile(path, bytes);
  return {path};
}

}  // namespace slcmap::exporting
