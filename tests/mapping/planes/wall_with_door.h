// A wall for tests of planes.
#pragma once

#include "mapping/map/building.h"

namespace slcmap::testing {

// y = 3, seen from y = 0, 4 m long and 2.5 m high, with a door 2 m high from x = 1 to 2.
inline Building WallWithDoor(double sigma_m) {
  BuildingPlane wall;
  wall.kind = PlaneKind::kWall;
  wall.normal = -Eigen::Vector3d::UnitY();
  wall.offset_m = -3;
  wall.sigma_m = sigma_m;
  wall.outline_world = {{0, 3, 0}, {4, 3, 0}, {4, 3, 2.5}, {0, 3, 2.5}};
  PlaneOpening door;
  door.outline_world = {{1, 3, 0}, {2, 3, 0}, {2, 3, 2}, {1, 3, 2}};
  wall.openings = {door};
  Building building;
  building.planes = {wall};
  return building;
}

}  // namespace slcmap::testing
