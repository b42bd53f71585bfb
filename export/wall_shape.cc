#include "export/wall_shape.h"

#include <algorithm>

#include "export/storey_at.h"

namespace slcmap {

WallHeight HeightOfWall(const PlanWall& wall, const Building& building, double assumed_height_m) {
  WallHeight height;
  if (const auto storey = StoreyOfId(building, wall.storey)) {
    const Storey& of_wall = building.storeys[*storey];
    height.floor_m = of_wall.floor_m;
    if (of_wall.ceiling_m) height.height_m = *of_wall.ceiling_m - of_wall.floor_m;
    if (of_wall.ceiling_m) return height;
  }
  for (const BuildingPlane& plane : building.planes) {
    if (std::find(wall.plane_ids.begin(), wall.plane_ids.end(), plane.id) == wall.plane_ids.end()) {
      continue;
    }
    for (const Eigen::Vector3d& p : plane.outline_world) {
      height.height_m = std::max(height.height_m, p.z() - height.floor_m);
    }
  }
  height.assumed = height.height_m < kLeastSolid_m;
  if (height.assumed) height.height_m = assumed_height_m;
  return height;
}

bool IsSolid(const PlanWall& wall, const WallHeight& height) {
  return (wall.end - wall.start).norm() > kLeastSolid_m && wall.thickness_m > kLeastSolid_m &&
         height.height_m > kLeastSolid_m;
}

std::optional<Eigen::AlignedBox2d> HoleOf(const PlanOpening& opening, const PlanWall& wall,
                                          const WallHeight& height) {
  const Eigen::Vector2d least(std::max(0.0, opening.from_m), std::max(0.0, opening.sill_m));
  const Eigen::Vector2d most(std::min((wall.end - wall.start).norm(), opening.to_m),
                             std::min(height.height_m, opening.sill_m + opening.clear_height_m));
  if (!((most - least).minCoeff() > kLeastSolid_m)) return std::nullopt;
  return Eigen::AlignedBox2d(least, most);
}

}  // namespace slcmap
