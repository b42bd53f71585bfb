// What a simulated building consists of: textured triangles, lamps, and its true edges.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/progress.h"
#include "data/simulator/camera_response.h"

namespace slcmap {

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
  kPoster,
  kLamp
};

struct SurfaceMaterial {
  TextureKind texture = TextureKind::kPlaster;
  float albedo = 0.5f;    // mean reflectance, 0 to 1
  float contrast = 1.0f;  // scale of the texture's deviations from the mean; 0 is uniform
  uint32_t seed = 1;      // of the pattern; posters of different seeds show different things
};

// A plane quadrilateral a, a + u, a + u + v, a + v in world coordinates (metres). Texture
// coordinates are metres along u and v from a (a poster is stretched over its quad instead). Curved
// things are made of many. Front is where u x v points; both sides are seen.
struct SceneQuad {
  Eigen::Vector3f a, u, v;
  uint32_t material = 0;  // index into Scene::materials
  // Texture coordinates at a: the pattern goes on across the quads that a wall is cut into.
  Eigen::Vector2f texture_origin = Eigen::Vector2f::Zero();
};

// A rectangle that emits light, also a quad of the scene (of a kLamp material).
struct SceneLamp {
  Eigen::Vector3f a, u, v;
  float radiance = 10;
};

// A straight edge of the building as a line detector could see it.
struct TrueEdge {
  Eigen::Vector3d a, b;  // metres, in world
  int axis = -1;         // 0, 1, 2: parallel to the axis of its wing; -1: to none
  int wing = 0;          // wings turned against each other have axes of their own
};

struct Scene {
  std::string name;
  std::vector<SurfaceMaterial> materials;
  std::vector<SceneQuad> quads;
  std::vector<SceneLamp> lamps;
  std::vector<TrueEdge> edges;
  float ambient = 0.1f;              // light that reaches everything, as radiance
  std::vector<double> wing_yaw_rad;  // heading of each wing's first axis in world
};

// Builds the scene that a YAML file describes. Deterministic. Throws ConfigError naming file and
// key, and StoppedError where progress ends it. The section `trajectory` is left to ReadScenario's
// reader of motions, `camera` to the next.
Scene ReadScene(const std::string& path, const Progress& progress = {});

// What the section `camera` says of the cameras that the building is seen with, and the defaults
// for the rest. Throws as above.
CameraResponseOptions ReadSceneCamera(const std::string& path);

}  // namespace slcmap
