#include "mapping/dense/depth_carving.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/error.h"

namespace slcmap {
namespace {

constexpr double kFreeSigmas = 3;
constexpr double kMaxCells = 1 << 30;  // around a camera, a bit each

// Of a point in units of cells.
OctreeCell CellOf(const Eigen::Vector3d& p) { return p.array().floor().cast<int>(); }

template <typename Visit>
void ForEachKnown(const DepthGrid& grid, const Camera& camera, const Visit& visit) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const DepthNode& node = grid.At(column, row);
      if (!node.is_known()) continue;
      visit(node, PinholeRay(camera, grid.ColumnPixel(column), grid.RowPixel(row)));
    }
  }
}

// A bit for each cell around a camera.
class CellBlock {
 public:
  CellBlock(const OctreeCell& centre, int reach)
      : first_(centre.array() - reach), side_(2 * reach + 1) {
    marks_.resize(static_cast<std::size_t>(side_) * side_ * side_);
  }

  // Returns whether the cell was not marked before.
  bool Mark(const OctreeCell& cell) {
    const std::size_t index = Index(cell);
    if (marks_[index]) return false;
    marks_[index] = true;
    return true;
  }

 private:
  std::size_t Index(const OctreeCell& cell) const {
    const OctreeCell at = cell - first_;
    return (static_cast<std::size_t>(at.x()) * side_ + at.y()) * side_ + at.z();
  }

  const OctreeCell first_;
  const int side_;
  std::vector<bool> marks_;
};

// Visits the cells from one point to another, as J. Amanatides and A. Woo, "A fast voxel traversal
// algorithm for ray tracing", 1987; both in units of cells.
template <typename Visit>
void ForEachCell(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Visit& visit) {
  const Eigen::Vector3d way = to - from;
  OctreeCell cell = CellOf(from);
  const OctreeCell last = CellOf(to);
  Eigen::Vector3i step;
  Eigen::Vector3d next, gap;  // where the ray leaves the cell along each axis, and from there on
  for (int i = 0; i < 3; ++i) {
    step[i] = way[i] > 0 ? 1 : -1;
    const double border = cell[i] + (step[i] > 0 ? 1 : 0);
    const bool is_along = std::abs(way[i]) > 1e-12;
    gap[i] = is_along ? std::abs(1 / way[i]) : std::numeric_limits<double>::infinity();
    next[i] = is_along ? (border - from[i]) / way[i] : std::numeric_limits<double>::infinity();
  }
  visit(cell);
  for (int steps = (last - cell).cwiseAbs().sum(); steps > 0; --steps) {
    int axis = 0;
    next.minCoeff(&axis);
    cell[axis] += step[axis];
    next[axis] += gap[axis];
    visit(cell);
  }
}

}  // namespace

DepthCarver::DepthCarver(double resolution_m, double max_range_m)
    : resolution_m_(resolution_m), max_range_m_(max_range_m) {
  const double side = 2 * (max_range_m / resolution_m + 2) + 1;
  if (side * side * side <= kMaxCells) return;
  throw ConfigError(fmt::format(
      "mapping.occupancy.resolution_m: found {}, which takes {:.3g} cells around a camera up to "
      "mapping.occupancy.max_range_m, {} m; expected at least {:.2g}",
      resolution_m, side * side * side, max_range_m, 2.05 * max_range_m / std::cbrt(kMaxCells)));
}

double DepthCarver::Reach_m(const Camera& camera, const DepthGrid& grid) const {
  double reach_m = 0;
  ForEachKnown(grid, camera, [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    reach_m = std::max(reach_m, node.depth_m() * ray.norm());
  });
  return std::min(reach_m, max_range_m_);
}

CellObservation DepthCarver::Observe(const RigidTransform& T_world_camera, const Camera& camera,
                                     const DepthGrid& grid) const {
  const Eigen::Vector3d origin = T_world_camera.translation / resolution_m_;
  CellBlock marked(CellOf(origin), static_cast<int>(Reach_m(camera, grid) / resolution_m_) + 2);
  CellObservation observation;
  const auto mark_occupied = [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    if (node.depth_m() * ray.norm() > max_range_m_) return;
    const OctreeCell cell =
        CellOf(origin + node.depth_m() / resolution_m_ * (T_world_camera.rotation * ray));
    if (marked.Mark(cell)) observation.occupied.push_back(cell);
  };
  const auto mark_free = [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    const double free_m =
        std::min(max_range_m_ / ray.norm(), node.depth_m() - kFreeSigmas * node.depth_sigma_m());
    if (free_m <= 0) return;
    const Eigen::Vector3d end = origin + free_m / resolution_m_ * (T_world_camera.rotation * ray);
    ForEachCell(origin, end, [&](const OctreeCell& cell) {
      if (marked.Mark(cell)) observation.free.push_back(cell);
    });
  };
  ForEachKnown(grid, camera, mark_occupied);  // first: marked cells are not marked again
  ForEachKnown(grid, camera, mark_free);
  return observation;
}

}  // namespace slcmap
