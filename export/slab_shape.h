// Floors and ceilings of a building as slabs: what formats with solids draw.
#pragma once

#include <vector>

#include "mapping/building/building.h"

namespace slcmap {

// How thick slabs are taken for: nobody sees it.
inline constexpr double kSlab_m = 0.2;

// Under a floor, or over a ceiling: metres, in world. Its other side is assumed.
struct Slab {
  const BuildingPlane* plane = nullptr;
  Polygon polygon;
  double low_m = 0, high_m = 0;

  bool IsFloor() const { return plane->kind == PlaneKind::kFloor; }
};

// Those of planes that are level and have an area, in the order of the planes; the number of floors
// and ceilings that are not is added to *left_out, where that is given. Where a slab of another
// storey or a room leaves less room than slab_m, it is as thick as that.
std::vector<Slab> SlabsOf(const Building& building, double slab_m, int* left_out = nullptr);

}  // namespace slcmap
