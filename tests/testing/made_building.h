// Buildings made by hand.
#pragma once

#include "mapping/map/map.h"

namespace slcmap::testing {

// Adds a room of that size, with walls of 0.2 m around it whose faces are its sides: the first wall
// (along its width) has a door of 0.9 m by 2.1 m that was walked through, one metre from its start,
// the third a window, the last an assumed thickness. The lower left corner is given; all is turned
// about the origin.
inline void AddRoom(const Eigen::Vector2d& corner, const Eigen::Vector2d& size_m, double turn_rad,
                    int64_t storey, Building* building) {
  const Eigen::Rotation2Dd turn(turn_rad);
  const PlanPoints outline = {turn * corner, turn * (corner + Eigen::Vector2d(size_m.x(), 0)),
                              turn * (corner + size_m),
                              turn * (corner + Eigen::Vector2d(0, size_m.y()))};
  Room room;
  room.id = static_cast<int64_t>(building->rooms.size());
  room.storey = storey;
  room.polygon.outline = outline;
  room.area_m2 = size_m.prod();
  room.height_m = 2.5;
  room.bounded = 1;
  building->rooms.push_back(room);
  for (size_t i = 0; i < 4; ++i) {  // walls go round a room clockwise
    PlanWall wall;
    wall.id = static_cast<int64_t>(building->walls.size());
    wall.storey = storey;
    wall.start = outline[(5 - i) % 4];
    wall.end = outline[(4 - i) % 4];
    wall.thickness_m = 0.2;
    wall.thickness_assumed = i == 3;
    wall.sigma_m = 0.004;
    if (i == 0) wall.openings = {{OpeningKind::kDoor, true, 1, 1.9, 0, 2.1}};
    if (i == 2) wall.openings = {{OpeningKind::kWindow, false, 1, 2.2, 0.9, 1.4}};
    building->walls.push_back(wall);
  }
}

// Storeys 3 m apart, each with a room of 4.000 m by 3.000 m.
inline Building MakeBuilding(int storeys = 1, double turn_rad = 0) {
  Building building;
  for (int i = 0; i < storeys; ++i) {
    building.storeys.push_back({i, 3.0 * i, 3.0 * i + 2.5});
    AddRoom({0, 0}, {4, 3}, turn_rad, i, &building);
  }
  return building;
}

}  // namespace slcmap::testing
