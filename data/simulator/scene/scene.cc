#include "data/simulator/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/yaml.h"
#include "data/simulator/scene/inexact_building.h"
#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/scene/scene_parts.h"

namespace slcmap::inline data {

std::vector<ScenePatch> MakePatches(const std::vector<SceneQuad>& quads) {
  std::vector<ScenePatch> patches;
  patches.reserve(quads.size());
  for (const SceneQuad& q : quads) {
    ScenePatch patch;
    patch.corners = {q.a, q.a + q.u, q.a + q.u + q.v, q.a + q.v};
    patch.normal = q.u.cross(q.v).normalized();
    patch.quad = static_cast<uint32_t>(patches.size());
    patches.push_back(patch);
  }
  return patches;
}

std::vector<ScenePatch> SeenPatches(const Scene& scene) {
  return scene.patches.empty() ? MakePatches(scene.quads) : scene.patches;
}

namespace {

const std::map<std::string, TextureKind>& Textures() {
  static const std::map<std::string, TextureKind> textures = {
      {"plain", TextureKind::kPlain},       {"plaster", TextureKind::kPlaster},
      {"concrete", TextureKind::kConcrete}, {"wood", TextureKind::kWood},
      {"carpet", TextureKind::kCarpet},     {"brick", TextureKind::kBrick},
      {"metal", TextureKind::kMetal},       {"tiles", TextureKind::kTiles},
      {"block", TextureKind::kBlock},       {"timber", TextureKind::kTimber},
      {"poster", TextureKind::kPoster},     {"ceiling_grid", TextureKind::kCeilingGrid},
      {"lamp", TextureKind::kLamp}};
  return textures;
}

using Palette = std::map<std::string, SurfaceMaterial>;

// What every scene can name; a scene's `materials` changes these and adds others.
Palette DefaultPalette() {
  return {{"block", {TextureKind::kBlock, 0.5f, 1.0f, 27}},
          {"brick", {TextureKind::kBrick, 0.4f, 1.0f, 11}},
          {"carpet", {TextureKind::kCarpet, 0.3f, 1.0f, 12}},
          {"ceiling", {TextureKind::kTiles, 0.75f, 0.4f, 13, 1.6f}},
          {"ceiling_grid", {TextureKind::kCeilingGrid, 0.75f, 1.0f, 28}},
          {"concrete", {TextureKind::kConcrete, 0.4f, 1.0f, 14}},
          {"cork", {TextureKind::kCarpet, 0.35f, 1.0f, 15}},
          {"dark", {TextureKind::kPlain, 0.08f, 1.0f, 16}},
          {"glass", {TextureKind::kPlain, 0.06f, 0.3f, 17}},
          {"lamp", {TextureKind::kLamp, 0.9f, 0.0f, 18}},
          {"metal", {TextureKind::kMetal, 0.45f, 1.0f, 19}},
          {"paint", {TextureKind::kMetal, 0.3f, 0.6f, 20}},
          {"paper", {TextureKind::kPlain, 0.7f, 0.6f, 21}},
          {"plaster", {TextureKind::kPlaster, 0.65f, 1.0f, 22}},
          {"red", {TextureKind::kPlain, 0.2f, 0.5f, 23}},
          {"tiles", {TextureKind::kTiles, 0.5f, 1.0f, 24}},
          {"timber", {TextureKind::kTimber, 0.4f, 1.0f, 29}},
          {"white", {TextureKind::kPlain, 0.8f, 0.4f, 25}},
          {"wood", {TextureKind::kWood, 0.45f, 1.0f, 26}}};
}

SurfaceMaterial ReadMaterial(YamlSection section, SurfaceMaterial material) {
  std::string texture;
  double albedo = material.albedo, contrast = material.contrast, scale = material.scale;
  int seed = static_cast<int>(material.seed);
  section.Read("texture", &texture);
  section.Read("albedo", &albedo);
  section.Read("contrast", &contrast);
  section.Read("seed", &seed);
  section.Read("scale", &scale);
  section.Finish();
  if (!texture.empty()) {
    const auto found = Textures().find(texture);
    if (found == Textures().end()) {
      std::string names;
      for (const auto& [name, kind] : Textures()) names += (names.empty() ? "" : ", ") + name;
      throw ConfigError(section.place() + ".texture: found '" + texture +
                        "', expected one of: " + names);
    }
    material.texture = found->second;
  }
  if (albedo < 0 || albedo > 1) {
    throw ConfigError(section.place() + ".albedo: expected 0 to 1");
  }
  if (contrast < 0 || contrast > 10) {
    throw ConfigError(section.place() + ".contrast: expected 0 to 10");
  }
  if (seed < 0) throw ConfigError(section.place() + ".seed: expected zero or more");
  if (!(scale >= 0.1 && scale <= 10)) {
    throw ConfigError(section.place() + ".scale: expected 0.1 to 10");
  }
  return {material.texture, static_cast<float>(albedo), static_cast<float>(contrast),
          static_cast<uint32_t>(seed), static_cast<float>(scale)};
}

// Lamps in a box of the world shine `factor` times as brightly.
struct Dimming {
  Eigen::AlignedBox3f box;
  float factor;
};

Eigen::Vector3f ReadCorner(YamlSection* section, const std::string& key) {
  std::vector<double> values;
  section->Read(key, &values);
  if (values.size() != 3) throw ConfigError(section->place() + "." + key + ": expected 3 numbers");
  return Eigen::Vector3d(values[0], values[1], values[2]).cast<float>();
}

Dimming ReadDimming(YamlSection section) {
  const Eigen::Vector3f from = ReadCorner(&section, "from"), to = ReadCorner(&section, "to");
  double factor = 0.1;
  section.Read("factor", &factor);
  section.Finish();
  if (factor < 0 || factor > 1000 || !((to - from).minCoeff() > 0)) {
    throw ConfigError(section.place() + ": expected `from` below `to`, and a factor of 0 to 1000");
  }
  return {Eigen::AlignedBox3f(from, to), static_cast<float>(factor)};
}

// A file with the one it is based on before it.
std::vector<YamlSection> ReadFiles(const std::string& path) {
  YamlSection root = YamlSection::FromFile(path);
  std::string base;
  root.Read("base", &base);
  std::vector<YamlSection> files;
  if (!base.empty()) {
    files.push_back(YamlSection::FromFile(std::filesystem::path(path).parent_path() / base));
    if (files[0].Has("base")) {
      throw ConfigError(root.place() + ": base: found '" + base +
                        "' with a base of its own, expected one without");
    }
  }
  files.push_back(root);
  return files;
}

std::vector<Eigen::Isometry3d> ReadWings(std::vector<YamlSection>* files) {
  std::vector<std::vector<double>> rows = {{0, 0, 0}};
  for (YamlSection& file : *files) {
    file.Read("wings", &rows);
    for (const std::vector<double>& row : rows) {
      const auto far = [](double value) { return std::abs(value) > 3600; };
      if (row.size() == 3 && std::none_of(row.begin(), row.end(), far)) continue;
      throw ConfigError(file.place() +
                        ": wings: expected rows of yaw_deg, x, y, each from -3600 to 3600");
    }
  }
  std::vector<Eigen::Isometry3d> world_wings;
  for (const std::vector<double>& row : rows) {
    Eigen::Isometry3d world_wing = Eigen::Isometry3d::Identity();
    world_wing.translation() << row[1], row[2], 0;
    world_wing.rotate(Eigen::AngleAxisd(row[0] * kDegree, Eigen::Vector3d::UnitZ()));
    world_wings.push_back(world_wing);
  }
  if (world_wings.empty()) {
    throw ConfigError(files->back().place() + ": wings: expected at least one");
  }
  return world_wings;
}

MaterialNames ReadMaterials(std::vector<YamlSection>* files, SceneBuilder* builder) {
  Palette palette = DefaultPalette();
  for (YamlSection& file : *files) {
    YamlSection section = file.Section("materials");
    for (const std::string& name : section.Keys()) {
      palette[name] = ReadMaterial(section.Section(name), palette[name]);
    }
  }
  MaterialNames names;
  for (const auto& [name, material] : palette) names[name] = builder->AddMaterial(material);
  return names;
}

void Dim(const std::vector<Dimming>& dimmings, Scene* scene) {
  for (SceneLamp& lamp : scene->lamps) {
    for (const Dimming& dimming : dimmings) {
      const Eigen::Vector3f middle = lamp.a + 0.5f * (lamp.u + lamp.v);
      if (dimming.box.contains(middle)) lamp.radiance *= dimming.factor;
    }
  }
}

// The scene's own before that of what it is based on, which is the first file.
// The section `georeference`: a system by its name, which says the scale at the place too, where
// the world's origin is in it, and how the world is turned.
std::optional<Georeference> ReadGeoreference(YamlSection section) {
  Georeference place;
  std::vector<double> origin_m;
  double turn_deg = 0;
  section.Read("crs", &place.crs);
  section.Read("origin_m", &origin_m);
  section.Read("turn_deg", &turn_deg);
  section.Finish();
  if (origin_m.empty()) return std::nullopt;
  if (origin_m.size() != 3) throw ConfigError(section.place() + ".origin_m: expected 3 numbers");
  place.origin_m = Eigen::Vector3d(origin_m[0], origin_m[1], origin_m[2]);
  place.turn_rad = turn_deg * kDegree;
  if (place.crs.empty()) return place;
  const auto on_earth = CoordinateSystem(place.crs).At(place.origin_m);
  if (!on_earth) {
    throw ConfigError(section.place() + ".origin_m: expected a place that " + place.crs +
                      " is for");
  }
  place.scale = on_earth->scale;
  return place;
}

std::string ReadName(const std::string& path, std::vector<YamlSection>* files) {
  std::string name = std::filesystem::path(path).stem();
  for (YamlSection& file : *files) file.Read("name", &name);
  return name;
}

}  // namespace

Scene ReadScene(const std::string& path, const Progress& progress,
                const std::optional<InexactOptions>& inexact) {
  std::vector<YamlSection> files = ReadFiles(path);
  const InexactOptions deviations = inexact.value_or(ReadSceneInexact(path));
  const std::vector<Eigen::Isometry3d> world_wings = ReadWings(&files);
  SceneBuilder builder(world_wings);
  const MaterialNames materials = ReadMaterials(&files, &builder);
  std::vector<Dimming> dimmings;
  const std::string name = ReadName(path, &files);
  double ambient = 0.05;
  std::optional<Georeference> georeference;
  for (YamlSection& file : files) {
    file.Read("ambient", &ambient);
    file.Section("trajectory");
    file.Section("camera");
    file.Section("inexact");
    if (const auto place = ReadGeoreference(file.Section("georeference"))) georeference = place;
    BuildPlan(file.Section("plan"), materials, &builder);
    for (const YamlSection& object : file.List("objects")) {
      ReadObject(object, materials, static_cast<int>(world_wings.size()), &builder);
    }
    for (const YamlSection& dim : file.List("dim")) dimmings.push_back(ReadDimming(dim));
    file.Finish();
  }
  if (ambient < 0 || ambient > 1000) throw ConfigError(path + ": ambient: expected 0 to 1000");
  Scene scene = builder.Finish(progress, deviations.amount > 0);
  if (scene.quads.empty()) throw ConfigError(path + ": objects: expected at least one");
  scene.name = name;
  scene.ambient = static_cast<float>(ambient);
  scene.georeference = georeference;
  Dim(dimmings, &scene);
  if (deviations.amount > 0) MakeInexact(deviations, &scene);
  return scene;
}

std::string ReadSceneName(const std::string& path) {
  std::vector<YamlSection> files = ReadFiles(path);
  return ReadName(path, &files);
}

InexactOptions ReadSceneInexact(const std::string& path) {
  InexactOptions inexact;
  for (YamlSection& file : ReadFiles(path)) inexact.Read(file.Section("inexact"));
  try {
    inexact.Check();
  } catch (const ConfigError& error) {
    throw NamingFile(path, error);
  }
  return inexact;
}

CameraResponseOptions ReadSceneCamera(const std::string& path) {
  CameraResponseOptions camera;
  for (YamlSection& file : ReadFiles(path)) camera.Read(file.Section("camera"));
  try {
    camera.Check();
  } catch (const ConfigError& error) {
    throw NamingFile(path, error);
  }
  return camera;
}

}  // namespace slcmap::data
