#include "export/gltf_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "data/error.h"
#include "data/file.h"
#include "export/axis_name.h"
#include "export/gltf_model.h"
#include "export/pipe_tubes.h"
#include "export/plan/wall_solids.h"
#include "export/storey_at.h"
#include "export/surface_mesh.h"
#include "mapping/building/building_names.h"

namespace slcmap {
namespace {

using Extras = tinygltf::Value::Object;

constexpr Colour kWallColour{222, 219, 211};
constexpr Colour kPlaneColour{200, 198, 192};
constexpr double kAssumedHeight_m = 2.5;  // of walls whose top was not seen, as in IFC

tinygltf::Value ValueOf(double value) { return tinygltf::Value(value); }
tinygltf::Value ValueOf(int64_t value) { return tinygltf::Value(static_cast<int>(value)); }
tinygltf::Value ValueOf(bool value) { return tinygltf::Value(value); }
tinygltf::Value ValueOf(const std::string& value) { return tinygltf::Value(value); }

template <typename T>
tinygltf::Value ArrayOf(const std::vector<T>& values) {
  tinygltf::Value::Array array;
  for (const T& value : values) array.push_back(ValueOf(value));
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
    if (most <= 0 || map_.dense.empty()) return;
    const int64_t every = (std::ssize(map_.dense) + most - 1) / most;
    Vertices vertices;
    for (std::size_t i = 0; i < map_.dense.size(); i += static_cast<std::size_t>(every)) {
      const uint8_t grey = map_.dense[i].grey;
      vertices.Add(map_.dense[i].p_world, {grey, grey, grey});
    }
    model_->AddLayer("dense", vertices, {}, TINYGLTF_MODE_POINTS, {{"one_of", ValueOf(every)}});
  }

  // The scene's lines are the map's, in their order, with two vertices each.
  void AddLines() {
    std::map<std::string, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < map_.lines.size(); ++i) {
      const MapLine& line = map_.lines[i];
      const double middle_m = 0.5 * (line.start_world.z() + line.end_world.z());
      const auto storey = StoreyAt(map_.building, middle_m);
      groups[StoreyPath("lines", map_.building, storey) + "/" + AxisName(line.axis)].push_back(i);
    }
    for (const auto& [path, lines] : groups) AddLineGroup(path, lines);
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
              {{"id", ValueOf(pipe.id)},
               {"kind", ValueOf(std::string("pipe"))},
               {"axis", ValueOf(std::string(AxisName(pipe.axis)))},
               {"radius_m", ValueOf(pipe.radius_m)},
               {"radius_sigma_m", ValueOf(pipe.radius_sigma_m)},
               {"sigma_m", ValueOf(pipe.sigma_m)}});
    }
  }

  void AddWalls() {
    const std::map<const PlanWall*, WallSolid> solids = SolidsOfWalls(map_.building);
    for (const PlanWall& wall : map_.building.walls) {
      const WallHeight height = HeightOfWall(wall, map_.building, kAssumedHeight_m);
      MeshLayer mesh;
      const auto solid = solids.find(&wall);
      const WallBack back = solid == solids.end() ? WallBack() : BackOf(solid->second);
      AddWallMesh(wall, height, kWallColour, &mesh, back);
      const auto storey = StoreyOfId(map_.building, wall.storey);
      AddMesh(StoreyPath("walls", map_.building, storey) + fmt::format("/wall {}", wall.id), mesh,
              {{"id", ValueOf(wall.id)},
               {"kind", ValueOf(std::string("wall"))},
               {"thickness_m", ValueOf(wall.thickness_m)},
               {"thickness_assumed", ValueOf(wall.thickness_assumed)},
               {"height_assumed", ValueOf(height.assumed)},
               {"sigma_m", ValueOf(wall.sigma_m)},
               {"plane_ids", ArrayOf(wall.plane_ids)}});
    }
  }

  // But those that walls are made of.
  void AddPlanes() {
    for (const BuildingPlane& plane : map_.building.planes) {
      if (IsOfWall(plane.id)) continue;
      MeshLayer mesh;
      AddPlaneMesh(plane, map_.building, kPlaneColour, &mesh);
      const auto storey = StoreyOfId(map_.building, plane.storey);
      AddMesh(StoreyPath("planes", map_.building, storey) + "/" + NameOf(plane.kind) +
                  fmt::format("/plane {}", plane.id),
              mesh,
              {{"id", ValueOf(plane.id)},
               {"kind", ValueOf(std::string(NameOf(plane.kind)))},
               {"sigma_m", ValueOf(plane.sigma_m)},
               {"inferred", ValueOf(plane.inferred)},
               {"room_ids", ArrayOf(plane.room_ids)}});
    }
  }

 private:
  void AddMesh(const std::string& path, const MeshLayer& layer, const Extras& extras) {
    model_->AddLayer(path, layer.vertices, Flat(layer.triangles), TINYGLTF_MODE_TRIANGLES, extras);
  }

  void AddLineGroup(const std::string& path, const std::vector<std::size_t>& lines) {
    const Vertices& all = scene_.lines[0].vertices;
    Vertices vertices;
    std::vector<int64_t> ids, kinds;
    std::vector<double> sigmas_m;
    for (const std::size_t i : lines) {
      for (const std::size_t k : {2 * i, 2 * i + 1}) vertices.Add(all.positions[k], all.colours[k]);
      ids.push_back(map_.lines[i].id);
      kinds.push_back(static_cast<int64_t>(map_.lines[i].kind));
      sigmas_m.push_back(map_.lines[i].sigma_m);
    }
    std::vector<uint32_t> indices(vertices.size());
    for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<uint32_t>(i);
    model_->AddLayer(path, vertices, indices, TINYGLTF_MODE_LINE,
                     {{"axis", ValueOf(std::string(AxisName(map_.lines[lines[0]].axis)))},
                      {"ids", ArrayOf(ids)},
                      {"kinds", ArrayOf(kinds)},
                      {"sigmas_m", ArrayOf(sigmas_m)}});
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

}  // namespace

std::vector<std::string> GltfWriter::Write(const std::string& folder, const MapResult& map,
                                           const Progress& progress) const {
  const MapScene& scene = scene_->Of(map, progress.Part(0, 0.5));
  GltfModel model(options_.quantised);
  model.SetOrigin(scene.map_id, scene.run_id, scene.world_offset_m);
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
  progress.ReportOrStop(0.75);
  const tinygltf::Model finished = model.Finish();
  const std::string path = folder + "/scene.glb";
  std::ostringstream bytes;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&finished, bytes, false, true)) {
    throw OutputError(path + ": cannot be written as glTF");
  }
  progress.ReportOrStop(0.9);
  WriteFile(path, bytes.str());
  return {path};
}

}  // namespace slcmap
