#include "export/slab_shape.h"

#include "export/surface_mesh.h"

namespace slcmap {
namespace {

constexpr double kLeastSlabArea_m2 = 1e-4;
constexpr double kLeastSlab_m = 1e-4;

bool IsFloorOrCeiling(const BuildingPlane& plane) {
  return plane.kind == PlaneKind::kFloor || plane.kind == PlaneKind::kCeiling;
}

bool IsLevel(const BuildingPlane& plane) {
  return IsFloorOrCeiling(plane) && plane.normal.z() != 0;
}

double HeightOf(const BuildingPlane& plane) { return plane.offset_m / plane.normal.z(); }

// As wanted, or as much as leaves room for the slab of the floor above a ceiling, or of the ceiling
// beneath a floor, and for the rooms there.
double SlabThickness(const BuildingPlane& plane, const Polygon& polygon, const Building& building,
                     double slab_m) {
  const bool is_floor = plane.kind == PlaneKind::kFloor;
  double thickness_m = slab_m;
  const auto keep_within = [&](double free_m, const Polygon& other) {
    if (free_m < kLeastSlab_m || free_m >= thickness_m) return;
    if (IntersectionArea(polygon, other) > kLeastSlabArea_m2) thickness_m = free_m;
  };
  for (const BuildingPlane& other : building.planes) {
    if (!IsLevel(other) || other.kind == plane.kind) continue;
    const double gap_m = (is_floor ? -1 : 1) * (HeightOf(other) - HeightOf(plane));
    keep_within(0.5 * gap_m, LevelOutline(other, building));
  }
  for (const Room& room : building.rooms) {
    if (is_floor && !room.height_m) continue;
    const double gap_m =
        is_floor ? HeightOf(plane) - room.floor_m - *room.height_m : room.floor_m - HeightOf(plane);
    keep_within(gap_m, room.polygon);
  }
  return thickness_m;
}

}  // namespace

std::vector<Slab> SlabsOf(const Building& building, double slab_m, int* left_out) {
  std::vector<Slab> slabs;
  for (const BuildingPlane& plane : building.planes) {
    if (!IsFloorOrCeiling(plane)) continue;
    Slab slab = {&plane, LevelOutline(plane, building), 0, 0};
    const bool has_area =
        slab.polygon.outline.size() >= 3 && Area(slab.polygon) > kLeastSlabArea_m2;
    if (!IsLevel(plane) || !has_area) {
      if (left_out != nullptr) ++*left_out;
      continue;
    }
    const double thickness_m = SlabThickness(plane, slab.polygon, building, slab_m);
    slab.low_m = HeightOf(plane) - (slab.IsFloor() ? thickness_m : 0);
    slab.high_m = slab.low_m + thickness_m;
    slabs.push_back(slab);
  }
  return slabs;
}

}  // namespace slcmap
