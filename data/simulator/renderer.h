// The simulator's renderer: a scene as the cameras of a moving rig see it, and which parts of the
// true edges they saw.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "data/simulator/ray_scene.h"
#include "data/simulator/scene/camera_response.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/sequence_writer.h"
#include "data/simulator/shading.h"

namespace slcmap::inline data {

// A part of a true edge, in metres from its end a.
struct SeenPart {
  int edge;  // index into Scene::edges
  double from_m, to_m;
};

// Watches which parts of the edges the cameras see as frames are looked at, in any order and from
// several threads.
class EdgeWatch {
 public:
  // All must outlive the watch. Throws ConfigError naming number and limit where the edges are too
  // long in all.
  EdgeWatch(const Scene& scene, const RayScene& rays, const RenderTask& task);

  // Looks at a frame, unless it was looked at or is not one of those at their interval.
  // Throws StoppedError where the task's stop is requested; what was seen until then counts.
  void Look(int frame);

  // The parts that either camera saw, by edge and place.
  std::vector<SeenPart> Parts() const;

 private:
  void LookThrough(const Camera& camera, const RigidTransform& T_world_camera);

  const Scene& scene_;
  const RayScene& rays_;
  const RenderTask& task_;
  // Flags that several threads set, no matter in which order.
  std::vector<uint8_t> is_due_;             // by frame
  std::vector<std::vector<uint8_t>> seen_;  // by edge and sample
};

// Writes edges.ply, the seen parts as an edge-PLY, and edges.csv, a row a seen part with the whole
// edge: edge, axis and wing as TrueEdge has them, its ends (metres, in world), seen_from_m and
// seen_to_m from end a. Edges that were not seen have one row with both zero. An edge that is bent
// has such rows for each of its straight pieces, one piece after the other. Throws OutputError.
void WriteEdges(const std::string& folder, const Scene& scene, const std::vector<SeenPart>& seen);

struct RendererOptions {
  LightBakingOptions light;
  CameraResponseOptions camera;
  void Check() const;  // throws ConfigError
};

// Bakes textures and light at once. Truth is written as described at WriteEdges, and
// the scene's surfaces as truth/surfaces.ply. Throws ConfigError, and DataError for a scene without
// quads.
std::unique_ptr<PairRenderer> MakeSceneRenderer(const Scene& scene, const RendererOptions& options,
                                                const RenderTask& task);

}  // namespace slcmap::data
