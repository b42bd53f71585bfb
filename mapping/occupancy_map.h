// Which space is occupied and which is free, as an octree of voxels (OctoMap).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "data/progress.h"

namespace slcmap {

// An occupied cube.
struct Voxel {
  Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();  // metres
  double size_m = 0;  // edge; larger ones stand for eight, pruned
};

// Rays from a camera centre to points that it saw (world, metres).
struct RayBundle {
  Eigen::Vector3d p_world_camera = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> p_world;
};

class OccupancyMap {
 public:
  explicit OccupancyMap(double resolution_m);
  ~OccupancyMap();
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;

  // Follows the rays of all bundles. The way to a point is free and its voxel is occupied; of a
  // point beyond max_range_m only the first part of the way counts. Within a bundle, occupied beats
  // free. Returns the number of rays that were left out, as they leave the octree, which reaches
  // 32767 voxels from the origin of the world. Once progress says so, later bundles are left out.
  int64_t Insert(const std::vector<RayBundle>& bundles, double max_range_m,
                 const Progress& progress = {});

  double resolution_m() const;
  std::vector<Voxel> OccupiedVoxels() const;  // in the tree's order
  bool IsOccupied(const Eigen::Vector3d& p_world) const;
  bool IsFree(
      const Eigen::Vector3d& p_world) const;  // seen to be free; neither holds where unknown

  // Writes the .bt file of OctoMap, which holds occupied, free and unknown without probabilities.
  // Throws OutputError.
  void Write(const std::string& path) const;

  // Throws DataError when the file is missing, damaged or not a .bt file (see octree_file.h).
  static OccupancyMap Read(const std::string& path);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap
