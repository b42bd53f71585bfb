// Which parts of the true edges the cameras of a rig saw.
#pragma once

#include <string>
#include <vector>

#include "data/simulator/pair_renderer.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene.h"

namespace slcmap {

struct EdgeVisibilityOptions {
  double sample_m = 0.02;    // along an edge
  double interval_s = 0.25;  // between the frames that are looked at
  double range_m = 30;       // up to which a camera counts as seeing
  double margin_m = 0.02;    // a surface this near in front of a point does not hide it
  void Check() const;        // throws ConfigError
};

// A part of a true edge, in metres from its end a.
struct SeenPart {
  int edge;  // index into Scene::edges
  double from_m, to_m;
};

// The parts that either camera saw in the first `frames` frames, by edge and place.
std::vector<SeenPart> FindSeenParts(const Scene& scene, const RayScene& rays,
                                    const RenderTask& task, int frames,
                                    const EdgeVisibilityOptions& options);

// Writes edges.ply, the seen parts as an edge-PLY, and edges.csv, a row a seen part with the whole
// edge: edge, axis and wing as TrueEdge has them, its ends (metres, in world), seen_from_m and
// seen_to_m from end a. Edges that were not seen have one row with both zero. Throws OutputError.
void WriteEdges(const std::string& folder, const Scene& scene, const std::vector<SeenPart>& seen);

}  // namespace slcmap
