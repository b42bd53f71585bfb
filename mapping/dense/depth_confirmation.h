// Depth that other views agree with.
#pragma once

#include <vector>

#include "data/types.h"
#include "mapping/dense/dense_options.h"
#include "mapping/dense/depth_grid.h"

namespace slcmap {

// A view's depth and where it was seen from.
struct PlacedGrid {
  RigidTransform T_world_camera;
  const DepthGrid* grid = nullptr;
};

// The nodes of `view` that at least min_views views (itself, and others more than min_baseline_m
// from it and from each other) agree with, within agree_sigmas standard deviations, and fewer
// contradict: those that see further at its place. The others become unknown.
DepthGrid ConfirmedDepth(const PlacedGrid& view, const std::vector<PlacedGrid>& others,
                         const Camera& camera, const DenseOptions& options);

}  // namespace slcmap
