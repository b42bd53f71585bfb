// Walls in the plan with their heights.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "export/plan/wall_solids.h"
#include "export/section/section_view.h"
#include "export/wall_shape.h"

namespace slcmap {

struct TallWall {
  WallSolid solid;
  WallHeight height;

  double Top_m() const { return height.floor_m + height.height_m; }
  // Of an opening: metres along the wall, and heights in world.
  std::optional<Eigen::AlignedBox2d> Hole(const PlanOpening& opening) const {
    auto hole = HoleOf(opening, *solid.wall, height);
    if (hole) hole->translate(Eigen::Vector2d(0, height.floor_m));
    return hole;
  }
};

// Those of the storeys that a view shows; walls whose top was not seen are 2.5 m high, as in IFC.
inline std::vector<TallWall> TallWalls(const Building& building, const SectionView& view) {
  constexpr double kAssumedHeight_m = 2.5;
  std::vector<TallWall> walls;
  for (const Storey& storey : building.storeys) {
    if (!view.Shows(storey.id)) continue;
    for (const WallSolid& solid : WallSolids(building, storey.id)) {
      const WallHeight height = HeightOfWall(*solid.wall, building, kAssumedHeight_m);
      if (IsSolid(*solid.wall, height)) walls.push_back({solid, height});
    }
  }
  return walls;
}

}  // namespace slcmap
