// Which space is occupied and which is free, as an octree of voxels (OctoMap); and the bytes of .bt
// files, checked first, as OctoMap's own reader trusts them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "data/core/progress.h"

namespace slcmap::inline mapping {

// Edge lengths of voxels that maps and their files may have.
inline constexpr double kMinVoxel_m = 1e-3;
inline constexpr double kMaxVoxel_m = 100;

// The depth of the leaves that are not pruned; that of the root is 0. OctoMap knows no other.
inline constexpr int kOctreeDepth = 16;

struct OctreeHeader {
  std::size_t nodes = 0;
  double resolution_m = 0;
  std::size_t data_offset = 0;  // of the first node's byte in the file
};

// The header as OctoMap 1.9 writes it for a tree of log-odds ("OcTree"): its first row, rows of
// comments, `id`, `size` and `res` once each, and `data`.
std::string OctreeHeaderText(std::size_t nodes, double resolution_m);

// Throws DataError naming path and row, what was found and what was expected.
OctreeHeader ParseOctreeHeader(const std::string& path, std::string_view bytes);

// Follows the nodes behind the header: an inner node has two bytes, two bits a child, lowest first
// (00 none, 01 a free leaf, 10 an occupied leaf, 11 an inner node), and is followed by its inner
// children in their order. Throws DataError naming path and byte unless they form one tree of at
// most kOctreeDepth, without inner nodes that have no child, of as many nodes and bytes as there
// should be. A header of no nodes is followed by nothing.
void CheckOctreeNodes(const std::string& path, std::string_view bytes, const OctreeHeader& header);

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

// A cell of the octree's smallest size: the cube from it to it + 1, in units of the resolution.
using OctreeCell = Eigen::Vector3i;

// What one view says of cells, each of them once.
struct CellObservation {
  std::vector<OctreeCell> free, occupied;
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
  // 32767 voxels from the origin of the world. Once progress says so, later bundles are left out,
  // and what takes long to finish, to write and to free is not kept: a tree of more than a million
  // nodes is left empty. Throws ConfigError, naming a resolution that would do, where the tree
  // grows beyond max_voxels.
  int64_t Insert(const std::vector<RayBundle>& bundles, double max_range_m,
                 const Progress& progress = {}, std::size_t max_voxels = SIZE_MAX);

  // Counts a view's observation, once a cell. Returns the number of cells that are out of the
  // octree. Finish() makes what Update() and Mark() did known to the whole tree.
  int64_t Update(const CellObservation& observation);
  // Makes cells free and occupied, whatever was seen of them; cells out of the octree are left out.
  void Mark(const CellObservation& cells);
  void Finish();

  double resolution_m() const;
  std::vector<Voxel> OccupiedVoxels() const;  // in the tree's order
  std::vector<Voxel> FreeVoxels() const;
  bool IsOccupied(const Eigen::Vector3d& p_world) const;
  bool IsFree(
      const Eigen::Vector3d& p_world) const;  // seen to be free; neither holds where unknown

  // Writes the .bt file of OctoMap, which holds occupied, free and unknown without probabilities.
  // Throws OutputError.
  void Write(const std::string& path) const;

  // Writes the .ot file of OctoMap, which holds probabilities too. Throws OutputError.
  void WriteProbabilities(const std::string& path) const;

  // The tree as bytes, to the last bit of its probabilities, and back.
  std::vector<uint8_t> Nodes() const;
  static OccupancyMap FromNodes(double resolution_m, const std::vector<uint8_t>& nodes);

  // Throws DataError when the file is missing, damaged or not a .bt file (see above).
  static OccupancyMap Read(const std::string& path);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap::mapping
