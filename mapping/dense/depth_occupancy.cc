#include "mapping/dense/depth_occupancy.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace slcmap {
namespace {

// Along the normal, in cells: a surface that lies at a cell's border takes both cells beside it, as
// it is known to less than a cell, and what is behind is not passable.
constexpr std::array<double, 3> kSurfaceOffsets = {0, 0.25, -0.5};

// The cells of the patch that a point stands for, each once.
std::vector<OctreeCell> CellsOf(const DensePoint& point, double spacing_m, double resolution_m) {
  // Less than a cell apart, from border to border of the patch.
  const int steps = static_cast<int>(std::ceil(spacing_m / (2 * resolution_m)));
  const Eigen::Vector3d across = 0.5 * spacing_m / steps * point.normal_world.unitOrthogonal();
  const Eigen::Vector3d up = point.normal_world.cross(across);
  std::vector<OctreeCell> cells;
  for (int i = -steps; i <= steps; ++i) {
    for (int j = -steps; j <= steps; ++j) {
      const Eigen::Vector3d p = (point.p_world + i * across + j * up) / resolution_m;
      for (const double offset : kSurfaceOffsets) {
        const OctreeCell cell = (p + offset * point.normal_world).array().floor().cast<int>();
        if (std::find(cells.begin(), cells.end(), cell) == cells.end()) cells.push_back(cell);
      }
    }
  }
  return cells;
}

}  // namespace

void MarkSurfaces(const std::vector<DensePoint>& points, double spacing_m, OccupancyMap* map) {
  for (const DensePoint& point : points) {
    map->Mark({{}, CellsOf(point, spacing_m, map->resolution_m())});
  }
}

DepthOccupancy::DepthOccupancy(const OccupancyOptions& options)
    : carver_(options.resolution_m, options.max_range_m), map_(options.resolution_m) {}

void DepthOccupancy::Add(const RigidTransform& T_world_camera, const Camera& camera,
                         const DepthGrid& depth) {
  out_of_octree_ += map_.Update(carver_.Observe(T_world_camera, camera, depth));
}

OccupancyMap DepthOccupancy::Finish(const std::vector<DensePoint>& points, double spacing_m) {
  MarkSurfaces(points, spacing_m, &map_);
  map_.Finish();
  return std::move(map_);
}

}  // namespace slcmap
