// What the cameras of a rig saw of the pipes of a simulated building.
#pragma once

#include <vector>

#include "data/simulator/pair_renderer.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene.h"
#include "data/true_pipes.h"

namespace slcmap {

// The pipes of a scene, numbered in its order, with what was seen of them from the first `frames`
// of the task, twice a second: where the middle of a pipe, as a camera sees it, is in the image and
// not hidden. Once the task's stop is requested, with what was seen until then.
std::vector<TruePipe> ObservePipes(const Scene& scene, const RayScene& rays, const RenderTask& task,
                                   int frames);

}  // namespace slcmap
