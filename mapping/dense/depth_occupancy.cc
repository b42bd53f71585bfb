#include "mapping/dense/depth_occupancy.h"

#include <array>

namespace slcmap {
namespace {

// Along the normal, in cells: a surface that lies at a cell's border takes both cells beside it, as
// it is known to less than a cell, and what is behind is not passable.
constexpr std::array<double, 3> kSurfaceOffsets = {0, 0.25, -0.5};

}  // namespace

DepthOccupancy::DepthOccupancy(const OccupancyOptions& options)
    : carver_(options.resolution_m, options.max_range_m), map_(options.resolution_m) {}

void DepthOccupancy::Add(const RigidTransform& T_world_camera, const Camera& camera,
                         const DepthGrid& depth) {
  out_of_octree_ += map_.Update(carver_.Observe(T_world_camera, camera, depth));
}

OccupancyMap DepthOccupancy::Finish(const std::vector<DensePoint>& points) {
  std::vector<Eigen::Vector3d> surfaces;
  for (const DensePoint& point : points) {
    for (const double offset : kSurfaceOffsets) {
      surfaces.emplace_back(point.p_world + offset * map_.resolution_m() * point.normal_world);
    }
  }
  map_.MarkOccupied(surfaces);
  map_.Finish();
  return std::move(map_);
}

}  // namespace slcmap
