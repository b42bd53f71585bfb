#include "mapping/dense/dense_stage.h"

#include "mapping/dense/dense_map.h"
#include "mapping/dense/depth_occupancy.h"
#include "mapping/occupancy.h"

namespace slcmap {
namespace {

// Every other node is enough for openings, which are some 40 cm wide.
Sights SightsOf(const RigidTransform& T_world_camera, const Camera& camera,
                const DepthGrid& depth) {
  constexpr int kStep = 2;
  Sights sights;
  sights.p_world_camera = T_world_camera.translation;
  for (int row = 0; row < depth.rows; row += kStep) {
    for (int column = 0; column < depth.columns; column += kStep) {
      const DepthNode& node = depth.At(column, row);
      if (!node.is_known()) continue;
      const Eigen::Vector3d ray =
          PinholeRay(camera, depth.ColumnPixel(column), depth.RowPixel(row));
      sights.p_world.push_back((T_world_camera * (node.depth_m() * ray)).cast<float>());
      sights.sigma_m.push_back(static_cast<float>(node.depth_sigma_m() * ray.norm()));
    }
  }
  return sights;
}

}  // namespace

std::vector<Sights> MapDensely(const Views& views, const ViewImages& images,
                               const MappingOptions& options, const Progress& progress,
                               MapResult* map) {
  DepthOccupancy occupancy(options.occupancy);
  const Rig& rig = images.rig();
  std::vector<Sights> sights;
  DenseMap dense = BuildDense(
      views, images, options.dense, progress, [&](std::size_t view, const DepthGrid& depth) {
        const RigidTransform T_world_camera = WorldFromCamera(views[view], rig);
        occupancy.Add(T_world_camera, rig.cameras[0], depth);
        sights.push_back(SightsOf(T_world_camera, rig.cameras[0], depth));
      });
  map->dense = std::move(dense.points);
  map->occupancy = occupancy.Finish(map->dense, options.dense.voxel_m);
  if (dense.views_without_images > 0) {
    map->warnings[kDenseViewWithoutImages] += dense.views_without_images;
  }
  if (occupancy.out_of_octree() > 0) map->warnings[kRayOutOfOctree] += occupancy.out_of_octree();
  return sights;
}

}  // namespace slcmap
