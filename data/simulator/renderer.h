// The simulator's renderer: a scene as the cameras of a moving rig see it.
#pragma once

#include <memory>

#include "data/simulator/camera_response.h"
#include "data/simulator/edge_visibility.h"
#include "data/simulator/light_baking.h"
#include "data/simulator/pair_renderer.h"
#include "data/simulator/scene.h"

namespace slcmap {

struct RendererOptions {
  LightBakingOptions light;
  CameraResponseOptions camera;
  EdgeVisibilityOptions edges;
  void Check() const;  // throws ConfigError
};

// Bakes textures and light at once. Truth is written as described in edge_visibility.h, and the
// scene's surfaces as truth/surfaces.ply. Throws ConfigError, and DataError for a scene without
// quads.
std::unique_ptr<PairRenderer> MakeSceneRenderer(const Scene& scene, const RendererOptions& options,
                                                const RenderTask& task);

}  // namespace slcmap
