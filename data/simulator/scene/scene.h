// What a simulated building consists of: textured triangles, lamps, and its true edges; and how far
// it is from plumb, straight and parallel.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/progress.h"
#include "data/io/yaml.h"
#include "data/simulator/scene/camera_response.h"

namespace slcmap::inline data {

// The section `inexact` of a scene.
struct InexactOptions {
  double amount = 0;  // 0: the exact building; 1: about as far as building tolerances let pass
  int seed = 1;       // chooses the deviations; another amount scales the same ones

  void Read(YamlSection section);
  void Check() const;  // throws ConfigError
};

// What a surface is made of; each kind is a procedural texture with detail at all scales.
enum class TextureKind {
  kPlain,
  kPlaster,
  kConcrete,
  kWood,
  kCarpet,
  kBrick,
  kMetal,
  kTiles,
  kBlock,
  kTimber,
  kCeilingGrid,
  kPoster,
  kTag,
  kLamp
};

// Over its quad, instead of running on from quad to quad.
inline bool IsStretched(TextureKind kind) {
  return kind == TextureKind::kPoster || kind == TextureKind::kTag;
}

struct SurfaceMaterial {
  TextureKind texture = TextureKind::kPlaster;
  float albedo = 0.5f;    // mean reflectance, 0 to 1
  float contrast = 1.0f;  // scale of the texture's deviations from the mean; 0 is uniform
  // Of the pattern; posters of different seeds show different things, and that of a tag says which
  // it is.
  uint32_t seed = 1;
  float scale = 1.0f;  // of the pattern's size
};

// A plane quadrilateral a, a + u, a + u + v, a + v in world coordinates (metres). Texture
// coordinates are metres along u and v from a (a poster or tag is stretched over its quad instead).
// Curved things are made of many. Front is where u x v points; both sides are seen.
struct SceneQuad {
  Eigen::Vector3f a, u, v;
  uint32_t material = 0;  // index into Scene::materials
  // Texture coordinates at a: the pattern goes on across the quads that a wall is cut into.
  Eigen::Vector2f texture_origin = Eigen::Vector2f::Zero();
  int body = -1;  // index into Scene::bodies
};

// A piece of a quad as it is seen: where its corners a, a + u, a + u + v, a + v are (metres, in
// world), and which part of its quad it is, in fractions along u and v.
struct ScenePatch {
  std::array<Eigen::Vector3f, 4> corners;
  Eigen::Vector3f normal;  // of the front, length 1
  uint32_t quad = 0;
  Eigen::Vector2f from = Eigen::Vector2f::Zero(), size = Eigen::Vector2f::Ones();
};

// What is put up as one: a piece of furniture, a door with its frame, a straight piece of a wall.
struct SceneBody {
  std::string kind;
  int wing = 0;
  bool is_fitting = false;            // put up by itself; else a part of the building
  Eigen::Isometry3d world_body;       // its frame
  Eigen::AlignedBox3d box_body = {};  // around its surfaces, in its frame (metres)
};

// A rectangle that emits light, also a quad of the scene (of a kLamp material).
struct SceneLamp {
  Eigen::Vector3f a, u, v;
  float radiance = 10;
};

// The seed of a tag's texture is its family's number in OpenCV times this, and its own.
inline constexpr uint32_t kTagsOfFamily = 10000;

// An AprilTag or ArUco tag on a wall: a control point.
struct SceneTag {
  std::string name;   // "tag36h11:5"
  uint32_t quad = 0;  // index into Scene::quads; the tag is in its middle
};

// A pane of clear glass: one sees through it, and it mirrors. Light passes it where it is baked,
// and the truth is of what lies behind it. An inexact building leaves it where the exact one has
// it.
struct ScenePane {
  Eigen::Vector3f a, u, v;
};

// A straight edge of the building as a line detector could see it.
struct TrueEdge {
  Eigen::Vector3d a, b;  // metres, in world
  int axis = -1;         // 0, 1, 2: parallel to the axis of its wing; -1: to none
  int wing = 0;          // wings turned against each other have axes of their own
  int body = -1;         // of a fitting's edge where the building is inexact
  // Of the bent edge that it is a piece of; pieces of one follow each other. -1: an edge by itself,
  // whose number is its index.
  int bent_edge = -1;
};

// A hole in a face of a wall, within its frame: metres along the face and above its foot.
struct SceneOpening {
  int id = 0;  // the same on both faces
  bool is_door = true;
  bool is_open = false;   // one sees and goes through
  bool is_clear = false;  // a pane of clear glass: one sees through
  double from_m = 0, to_m = 0, low_m = 0, high_m = 0;
};

// One side of a straight wall as the exact building has it (metres, in world).
struct SceneWallFace {
  Eigen::Vector3d foot_world, end_world;  // of its foot; seen from its front, foot is at the right
  Eigen::Vector3d normal;                 // out of the wall
  double height_m = 0;
  double thickness_m = 0;
  bool is_solid = false;  // what lies behind it, to its thickness, is wall
  std::vector<SceneOpening> openings;
};

struct InexactTruth {
  InexactOptions options;
  double max_displacement_m = 0;  // of any corner of a surface
  // Where a point of walls and slabs of the exact building is.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> Displaced;
};

// A round bar: a pipe, a column, a leg.
struct ScenePipe {
  Eigen::Vector3d a, b;  // ends of its axis (metres, in world)
  double radius_m = 0;
  int body = -1;
};

struct Scene {
  std::string name;
  std::vector<SurfaceMaterial> materials;
  std::vector<SceneQuad> quads;
  std::vector<SceneBody> bodies;
  std::vector<SceneLamp> lamps;
  std::vector<SceneTag> tags;
  std::vector<ScenePane> panes;
  std::vector<TrueEdge> edges;
  std::vector<ScenePipe> pipes;
  std::vector<SceneWallFace> wall_faces;
  float ambient = 0.1f;                      // light that reaches everything, as radiance
  std::optional<Georeference> georeference;  // where on Earth it stands
  std::vector<double> wing_yaw_rad;          // heading of each wing's first axis in world

  // Of an inexact building: quads and lamps are those of the exact one, whose light it has; patches
  // and edges are where they are seen. None of an exact one: its quads are seen as they are.
  std::vector<ScenePatch> patches;
  std::optional<InexactTruth> inexact;
};

// What is seen of a scene: its patches, or each quad as one.
std::vector<ScenePatch> SeenPatches(const Scene& scene);
std::vector<ScenePatch> MakePatches(const std::vector<SceneQuad>& quads);

// Builds the scene that a YAML file describes. Deterministic. Throws ConfigError naming file and
// key, and StoppedError where progress ends it. The section `trajectory` is left to those
// who read motions, `camera` to the next. `inexact` stands for what the section of that name says.
Scene ReadScene(const std::string& path, const Progress& progress = {},
                const std::optional<InexactOptions>& inexact = {});

// The scene's name; the file's where it has none. Throws as above.
std::string ReadSceneName(const std::string& path);

// What the section `inexact` says. Throws as above.
InexactOptions ReadSceneInexact(const std::string& path);

// What the section `camera` says of the cameras that the building is seen with, and the defaults
// for the rest. Throws as above.
CameraResponseOptions ReadSceneCamera(const std::string& path);

}  // namespace slcmap::data
