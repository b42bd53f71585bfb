#include "data/simulator/scene.h"

namespace slcmap {

std::vector<ScenePatch> PatchesOf(const std::vector<SceneQuad>& quads) {
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
  return scene.patches.empty() ? PatchesOf(scene.quads) : scene.patches;
}

}  // namespace slcmap
