#include "mapping/dense/dense_stage.h"

#include "mapping/dense/dense_map.h"
#include "mapping/dense/depth_occupancy.h"
#include "mapping/occupancy.h"

namespace slcmap {

void MapDensely(const Views& views, const ViewImages& images, const MappingOptions& options,
                const Progress& progress, MapResult* map) {
  DepthOccupancy occupancy(options.occupancy);
  const Rig& rig = images.rig();
  DenseMap dense = BuildDense(
      views, images, options.dense, progress, [&](std::size_t view, const DepthGrid& depth) {
        occupancy.Add(WorldFromCamera(views[view], rig), rig.cameras[0], depth);
      });
  map->dense = std::move(dense.points);
  map->occupancy = occupancy.Finish(map->dense);
  if (dense.views_without_images > 0) {
    map->warnings[kDenseViewWithoutImages] += dense.views_without_images;
  }
  if (occupancy.out_of_octree() > 0) map->warnings[kRayOutOfOctree] += occupancy.out_of_octree();
}

}  // namespace slcmap
