// Which cells of space a view's depth shows to be free, and which to be occupied.
#pragma once

#include <cstdint>
#include <vector>

#include "data/types.h"
#include "mapping/dense/depth_grid.h"
#include "mapping/occupancy_map.h"

namespace slcmap {

// Cells are cubes of an octree, cell (0, 0, 0) from the origin of the world on.
class DepthCarver {
 public:
  // Throws ConfigError where the cells around a camera, up to max_range_m, would take too much
  // memory.
  DepthCarver(double resolution_m, double max_range_m);

  // Follows the rays of the known nodes. Free is what a ray passes up to three standard deviations
  // before its depth, at most max_range_m far; occupied are the cells at the depths within that
  // range, which beat free ones. A cell counts once, however many rays pass it.
  CellObservation Observe(const RigidTransform& T_world_camera, const Camera& camera,
                          const DepthGrid& grid) const;

 private:
  // How far the rays of the known nodes go, up to max_range_m.
  double Reach_m(const Camera& camera, const DepthGrid& grid) const;

  const double resolution_m_, max_range_m_;
};

}  // namespace slcmap
