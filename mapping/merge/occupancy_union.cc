#include "mapping/merge/occupancy_union.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <set>

#include "data/error.h"
#include "mapping/dense/depth_occupancy.h"

namespace slcmap {
namespace {

constexpr int kBlock = 8;  // cells of a side
// What buildings fill is far less; a damaged tree can call half of its world free.
constexpr double kMostBlocks = 2e6;

using Block = std::array<int, 3>;

// The blocks of cells that cubes lie in or touch.
void AddBlocks(const std::vector<Voxel>& voxels, const RigidTransform& T, double resolution_m,
               std::set<Block>* blocks) {
  const double block_m = kBlock * resolution_m;
  for (const Voxel& voxel : voxels) {
    const Eigen::Vector3d centre = T * voxel.centre_world;
    // Turned cubes reach farther than they are wide.
    const double reach_m = 0.5 * std::sqrt(3.0) * voxel.size_m;
    const Eigen::Vector3i from = ((centre.array() - reach_m) / block_m).floor().cast<int>();
    const Eigen::Vector3i to = ((centre.array() + reach_m) / block_m).floor().cast<int>();
    if (static_cast<double>(blocks->size()) + ((to - from).cast<double>().array() + 1).prod() >
        kMostBlocks) {
      throw DataError(fmt::format(
          "occupancy: found known space of more than {:.0f} m3, expected that of a building",
          kMostBlocks * block_m * block_m * block_m));
    }
    for (int x = from.x(); x <= to.x(); ++x) {
      for (int y = from.y(); y <= to.y(); ++y) {
        for (int z = from.z(); z <= to.z(); ++z) blocks->insert({x, y, z});
      }
    }
  }
}

enum class Cell { kUnknown, kFree, kOccupied };

Cell CellAt(const OccupancyMap& map, const Eigen::Vector3d& p) {
  if (map.IsOccupied(p)) return Cell::kOccupied;
  return map.IsFree(p) ? Cell::kFree : Cell::kUnknown;
}

Cell Both(Cell a, Cell b) {
  if (a == Cell::kFree || b == Cell::kFree) return Cell::kFree;
  return a == Cell::kOccupied || b == Cell::kOccupied ? Cell::kOccupied : Cell::kUnknown;
}

}  // namespace

OccupancyMap UniteOccupancy(const OccupancyMap& first, const OccupancyMap& second,
                            const RigidTransform& T_first_second,
                            const std::vector<DensePoint>& united, double spacing_m) {
  const double resolution_m = first.resolution_m();
  const RigidTransform T_second_first = T_first_second.Inverse();
  std::set<Block> blocks;
  for (const bool occupied : {false, true}) {
    const auto voxels = [&](const OccupancyMap& map) {
      return occupied ? map.OccupiedVoxels() : map.FreeVoxels();
    };
    AddBlocks(voxels(first), RigidTransform(), resolution_m, &blocks);
    AddBlocks(voxels(second), T_first_second, resolution_m, &blocks);
  }
  OccupancyMap map(resolution_m);
  for (const Block& block : blocks) {
    CellObservation cells;
    for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
      const OctreeCell cell(kBlock * block[0] + i % kBlock, kBlock * block[1] + i / kBlock % kBlock,
                            kBlock * block[2] + i / kBlock / kBlock);
      const Eigen::Vector3d centre = resolution_m * (cell.cast<double>().array() + 0.5);
      const Cell state = Both(CellAt(first, centre), CellAt(second, T_second_first * centre));
      if (state == Cell::kFree) cells.free.push_back(cell);
      if (state == Cell::kOccupied) cells.occupied.push_back(cell);
    }
    map.Mark(cells);
  }
  MarkSurfaces(united, spacing_m, &map);
  map.Finish();
  return map;
}

}  // namespace slcmap
