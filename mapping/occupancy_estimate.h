// How many voxels rays will take, before any is made.
#pragma once

#include <vector>

#include "mapping/occupancy_map.h"

namespace slcmap {

class VoxelEstimate {
 public:
  // Rays are followed up to max_range_m.
  VoxelEstimate(const std::vector<RayBundle>& bundles, double max_range_m);

  // No more than there are steps from voxel to voxel along the rays; and, where rays lie side by
  // side, no more than fit into the space that they pass, as counted in coarser voxels. Falls with
  // the resolution.
  double Voxels(double resolution_m) const;

  // The least resolution, rounded up to two digits, that takes at most max_voxels.
  double LeastResolution_m(double max_voxels) const;

 private:
  struct Count {
    double voxel_m = 0;
    double voxels = 0;  // of that size, that rays pass
  };

  double rays_ = 0, steps_m_ = 0;  // the sum over the rays of |dx| + |dy| + |dz|
  std::vector<Count> counts_;      // each with twice the voxel of the one before
};

}  // namespace slcmap
