// Walls of a building as boxes with holes: what formats with solids draw.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "mapping/building/building.h"

namespace slcmap {

// The least extent of what is a solid (metres).
inline constexpr double kLeastSolid_m = 1e-4;

struct WallHeight {
  double floor_m = 0;  // of its storey, in world
  double height_m = 0;
  bool assumed = false;
};

// From the floor of the wall's storey to its ceiling, else as high as the wall's planes were seen,
// else as assumed.
WallHeight HeightOfWall(const PlanWall& wall, const Building& building, double assumed_height_m);

// False where a wall has no length, thickness or height.
bool IsSolid(const PlanWall& wall, const WallHeight& height);

// The part of an opening that is in its wall: metres along the wall, and over its floor. Nothing
// where there is none.
std::optional<Eigen::AlignedBox2d> HoleOf(const PlanOpening& opening, const PlanWall& wall,
                                          const WallHeight& height);

}  // namespace slcmap
