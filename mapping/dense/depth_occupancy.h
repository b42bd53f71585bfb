// Occupied, free and unknown space from the depth of many views.
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/dense/dense_point.h"
#include "mapping/dense/depth_carving.h"
#include "mapping/map_options.h"

namespace slcmap {

// Makes the cells of surfaces occupied, and those half a cell behind them, whatever single views
// said of these. Each point stands for a patch of its surface that is spacing_m wide. Inner cells
// of the tree know of it after OccupancyMap::Finish().
void MarkSurfaces(const std::vector<DensePoint>& points, double spacing_m, OccupancyMap* map);

class DepthOccupancy {
 public:
  // Throws ConfigError where the resolution would take too much memory.
  explicit DepthOccupancy(const OccupancyOptions& options);

  // A view's confirmed depth: one observation of each cell that it tells of. Cells out of the
  // octree are left out and counted.
  void Add(const RigidTransform& T_world_camera, const Camera& camera, const DepthGrid& depth);

  // The map once all views are in, with the surfaces fused of them marked.
  OccupancyMap Finish(const std::vector<DensePoint>& points, double spacing_m);

  int64_t out_of_octree() const { return out_of_octree_; }

 private:
  const DepthCarver carver_;
  OccupancyMap map_;
  int64_t out_of_octree_ = 0;
};

}  // namespace slcmap
