// Buildings that are made by hand, for tests of what is written from them.
#pragma once

#include <cmath>

#include "mapping/map/map.h"

namespace slcmap::testing {

inline constexpr double kWingTurn_rad = 0.2094;  // 12 degrees

inline Eigen::Vector2d Turned(double x, double y, double angle_rad) {
  return {std::cos(angle_rad) * x - std::sin(angle_rad) * y,
          std::sin(angle_rad) * x + std::cos(angle_rad) * y};
}

inline PlanWall MakeWall(int64_t id, int64_t storey, const Eigen::Vector2d& start,
                         const Eigen::Vector2d& end, double thickness_m, bool assumed) {
  PlanWall wall;
  wall.id = id;
  wall.storey = storey;
  wall.start = start;
  wall.end = end;
  wall.thickness_m = thickness_m;
  wall.thickness_assumed = assumed;
  wall.sigma_m = 0.004;
  wall.plane_ids = {id + 2};  // after those of floor and ceiling
  return wall;
}

inline BuildingPlane MakeLevelPlane(int64_t id, const Room& room, PlaneKind kind, double z_m) {
  BuildingPlane plane;
  plane.id = id;
  plane.kind = kind;
  plane.storey = room.storey;
  plane.normal = {0, 0, kind == PlaneKind::kFloor ? 1.0 : -1.0};
  plane.offset_m = plane.normal.z() * z_m;
  plane.sigma_m = 0.003;
  for (const Eigen::Vector2d& p : room.polygon.outline) {
    plane.outline_world.emplace_back(p.x(), p.y(), z_m);
  }
  plane.room_ids = {room.id};
  return plane;
}

// Two storeys. Below, a room of 8 m x 6 m around a pillar of 1 m x 1 m, with a ceiling at 2.7 m;
// its first wall has a doorway that was walked through, a window and a passage that reaches its end
// and the ceiling; the third belongs to a wing that is turned by 12 degrees and has a thickness
// that is assumed. Above, at 3 m, a wall and a room whose ceilings were not seen.
inline MapResult MakeTwoStoreys() {
  MapResult map;
  map.id = "0123456789abcdef";
  map.source.run_id = "fedcba9876543210";
  Building& building = map.building;
  building.storeys = {{0, -0.5, 2.2}, {1, 3.0, std::nullopt}};

  Room below;
  below.polygon = {{{0, 0}, {8, 0}, {8, 6}, {0, 6}}, {{{3, 2}, {3, 3}, {4, 3}, {4, 2}}}};
  below.area_m2 = 47;
  below.floor_m = -0.5;
  below.height_m = 2.7;
  below.bounded = 0.9;
  Room above;
  above.id = 1;
  above.storey = 1;
  above.polygon = {{{0, 0}, {4, 0}, {4, 6}}, {}};
  above.area_m2 = 12;
  above.floor_m = 3.0;
  building.rooms = {below, above};
  building.planes = {MakeLevelPlane(0, below, PlaneKind::kFloor, -0.5),
                     MakeLevelPlane(1, below, PlaneKind::kCeiling, 2.2)};

  building.walls = {
      MakeWall(0, 0, {0, 6}, {8, 6}, 0.24, false), MakeWall(1, 0, {0, 0}, {0, 6}, 0.1, false),
      MakeWall(2, 0, {10, 0}, Eigen::Vector2d(10, 0) + Turned(5, 0, kWingTurn_rad), 0.15, true),
      MakeWall(3, 1, {4, 0}, {0, 0}, 0.2, false)};
  building.walls[0].openings = {{OpeningKind::kDoor, true, 1.0, 1.9, 0, 2.05},
                                {OpeningKind::kWindow, false, 3.0, 4.5, 0.9, 1.2},
                                {OpeningKind::kPassage, false, 6.5, 8.0, 0, 2.7}};

  map.lines = {{0, 0, LineAxis::kX, 0, 0.002, true, {0, 0, -0.5}, {8, 0, -0.5}},
               {1, 0, LineAxis::kVertical, 0, 0.003, true, {0, 0, -0.5}, {0, 0, 2.2}},
               {2, 0, LineAxis::kNone, 0, 0.004, false, {0, 0, 3.1}, {1, 1, 4.2345}}};
  return map;
}

}  // namespace slcmap::testing
