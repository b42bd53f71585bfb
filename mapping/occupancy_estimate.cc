#include "mapping/occupancy_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace slcmap {
namespace {

constexpr double kMaxCoarseSteps = 3e7;  // what counting may cost: seconds, after hours of rays
constexpr std::size_t kSortAt = std::size_t{1} << 22;
constexpr double kMinCoarse_m = 0.05;
constexpr double kStepsAVoxel = 2;
constexpr int kCounts = 5;
constexpr double kMaxCoordinate_m = 1e6;  // what is further away, an octree does not reach

// Calls visit(start, way) for each ray, cut off at max_range_m.
template <typename Visitor>
void ForEachRay(const std::vector<RayBundle>& bundles, double max_range_m, Visitor visit) {
  for (const RayBundle& bundle : bundles) {
    for (const Eigen::Vector3d& p : bundle.p_world) {
      const Eigen::Vector3d way = p - bundle.p_world_camera;
      if (!way.allFinite() || !(bundle.p_world_camera.norm() < kMaxCoordinate_m)) continue;
      visit(bundle.p_world_camera, way * std::min(1.0, max_range_m / way.norm()));
    }
  }
}

using Cell = std::array<int32_t, 3>;

Cell CellAt(const Eigen::Vector3d& p_world, double voxel_m) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = static_cast<int32_t>(std::floor(p_world[axis] / voxel_m));
  }
  return cell;
}

void SortAndUnite(std::vector<Cell>* cells) {
  std::sort(cells->begin(), cells->end());
  cells->erase(std::unique(cells->begin(), cells->end()), cells->end());
}

// The cells that rays pass, sorted.
std::vector<Cell> PassedCells(const std::vector<RayBundle>& bundles, double max_range_m,
                              double voxel_m) {
  std::vector<Cell> cells;
  std::size_t sort_at = kSortAt;  // keeps the memory at what differs
  ForEachRay(bundles, max_range_m, [&](const Eigen::Vector3d& start, const Eigen::Vector3d& way) {
    const double steps = std::ceil(kStepsAVoxel * way.lpNorm<1>() / voxel_m) + 1;
    for (double i = 0; i <= steps; ++i) cells.push_back(CellAt(start + i / steps * way, voxel_m));
    if (cells.size() < sort_at) return;
    SortAndUnite(&cells);
    sort_at = std::max(kSortAt, 2 * cells.size());
  });
  SortAndUnite(&cells);
  return cells;
}

// Of cells of twice the size.
void Coarsen(std::vector<Cell>* cells) {
  for (Cell& cell : *cells) {
    for (int32_t& index : cell) index >>= 1;
  }
  SortAndUnite(cells);
}

// Rounded up to two digits.
double RoundUp(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::ceil(value / unit - 1e-9) * unit;
}

}  // namespace

VoxelEstimate::VoxelEstimate(const std::vector<RayBundle>& bundles, double max_range_m) {
  ForEachRay(bundles, max_range_m, [&](const Eigen::Vector3d&, const Eigen::Vector3d& way) {
    ++rays_;
    steps_m_ += way.lpNorm<1>();
  });
  double voxel_m = std::max(kStepsAVoxel * steps_m_ / kMaxCoarseSteps, kMinCoarse_m);
  std::vector<Cell> cells = PassedCells(bundles, max_range_m, voxel_m);
  for (int i = 0; i < kCounts; ++i) {
    counts_.push_back({voxel_m, static_cast<double>(cells.size())});
    voxel_m *= 2;
    Coarsen(&cells);
  }
}

double VoxelEstimate::Voxels(double resolution_m) const {
  double voxels = steps_m_ / resolution_m + rays_;
  for (const Count& count : counts_) {
    const double in_each = std::max(1.0, std::pow(count.voxel_m / resolution_m, 3));
    voxels = std::min(voxels, count.voxels * in_each);
  }
  return voxels;
}

double VoxelEstimate::LeastResolution_m(double max_voxels) const {
  double low_m = 1e-6, high_m = 1e6;  // by halves of their ratio
  while (high_m / low_m > 1.001) {
    const double middle_m = std::sqrt(low_m * high_m);
    (Voxels(middle_m) > max_voxels ? low_m : high_m) = middle_m;
  }
  return RoundUp(high_m);
}

}  // namespace slcmap
