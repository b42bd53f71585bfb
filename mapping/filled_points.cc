#include "mapping/filled_points.h"

#include "mapping/dense/depth_occupancy.h"

namespace slcmap {

void AddFilledPoints(const std::vector<DensePoint>& filled, double spacing_m, MapResult* map) {
  MarkSurfaces(filled, spacing_m, &map->occupancy);
  map->occupancy.Finish();
  map->dense.insert(map->dense.end(), filled.begin(), filled.end());
}

void RemoveFilledPoints(MapResult* map) {
  std::erase_if(map->dense,
                [](const DensePoint& point) { return point.source == DenseSource::kFilledPlane; });
}

}  // namespace slcmap
