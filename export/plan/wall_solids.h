// The walls of a storey as areas: joined at corners, cut by their openings.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <map>
#include <utility>
#include <vector>

#include "data/polygon.h"
#include "mapping/building/building.h"

namespace slcmap {

// A wall in the plan's frame (Building::T_map_world), in metres: from start to end along its face,
// behind which, to the left of that direction, it has its thickness.
struct WallSolid {
  const PlanWall* wall = nullptr;
  Eigen::Vector2d start, end;
  Eigen::Vector2d back_start, back_end;  // where the back ends: at corners, on the next wall's back

  double Length() const { return (end - start).norm(); }
  Eigen::Vector2d Direction() const { return (end - start).normalized(); }
  Eigen::Vector2d Behind() const { return {-Direction().y(), Direction().x()}; }
  double Thickness() const { return (back_start - start).dot(Behind()); }
  // The point that far along the face, and that far behind it.
  Eigen::Vector2d At(double along_m, double behind_m) const {
    return start + along_m * Direction() + behind_m * Behind();
  }
};

// A border of the walls of a storey.
struct WallEdge {
  Eigen::Vector2d start, end;
  bool assumed = false;  // it is the back of a wall whose thickness was assumed
};

// The walls of a storey that have a length.
std::vector<WallSolid> WallSolids(const Building& building, int64_t storey);

// Those of all walls of a building that have a length, in world.
std::map<const PlanWall*, WallSolid> SolidsOfWalls(const Building& building);

// How the back of a wall goes beyond its face (negative: ends before it) at both ends, in metres
// along it: as it is joined to the next one at a corner. 0 at an end that an opening reaches.
struct WallBack {
  double before_start_m = 0, beyond_end_m = 0;
};
WallBack BackOf(const WallSolid& solid);

// The stretches of a wall between its openings, in metres from its start.
std::vector<std::pair<double, double>> Stretches(const WallSolid& solid);

// The area of a stretch of a wall, counter-clockwise.
Polygon MakePiece(const WallSolid& solid, double from_m, double to_m);

// The area of walls, without their openings.
std::vector<Polygon> WallAreas(const std::vector<WallSolid>& solids);

// Whether a point on the border of walls is on no more than backs whose thickness was assumed.
bool IsAssumedBorder(const std::vector<WallSolid>& solids, const Eigen::Vector2d& point);

// The borders of those areas, once each; walls that overlap are one.
std::vector<WallEdge> WallEdges(const std::vector<WallSolid>& solids);

// The polygon of a room in the plan's frame.
Polygon RoomInPlan(const Building& building, const Room& room);

// Of the walls and rooms of all storeys in the plan's frame; empty where there are none.
Eigen::AlignedBox2d PlanExtent(const Building& building);

}  // namespace slcmap
