// Walls and slabs of a building as solids, and which storey something belongs to.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "data/core/polygon.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// The index of the storey that a height in world belongs to: the highest whose floor is not above
// it, the lowest for what is beneath all; nothing where the building has no storeys.
std::optional<std::size_t> StoreyAt(const Building& building, double height_m);

// The index of the storey of that id; nothing where there is none.
std::optional<std::size_t> StoreyOfId(const Building& building, int64_t id);

// That in which the middle of a line, or of the axis of a pipe, is.
template <typename Line>
std::optional<std::size_t> StoreyAtMiddle(const Building& building, const Line& line) {
  return StoreyAt(building, 0.5 * (line.start_world.z() + line.end_world.z()));
}

// Walls of a building as boxes with holes: what formats with solids draw.

// The least extent of what is a solid (metres).
inline constexpr double kLeastSolid_m = 1e-4;
// Smaller holes between walls are slivers.
inline constexpr double kLeastHole_m2 = 5e-3;
// What outlines are cut and united on.
inline constexpr double kOutlineGrid_m = 1e-5;

struct WallHeight {
  double floor_m = 0;  // of its storey, in world
  double height_m = 0;
  bool assumed = false;
};

// From the floor of the wall's storey to its ceiling, else as high as the wall's planes were seen,
// else 2.5 m, as is assumed.
WallHeight HeightOfWall(const PlanWall& wall, const Building& building);

// False where a wall has no length, thickness or height.
bool IsSolid(const PlanWall& wall, const WallHeight& height);

// The part of an opening that is in its wall: metres along the wall, and over its floor. Nothing
// where there is none.
std::optional<Eigen::AlignedBox2d> ComputeHole(const PlanOpening& opening, const PlanWall& wall,
                                               const WallHeight& height);

// Whether a room or a slab is worth a solid.
bool HasArea(const Polygon& polygon);

// Floors and ceilings of a building as slabs: what formats with solids draw.

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
// storey or a room leaves less room than kSlab_m, it is as thick as that.
std::vector<Slab> MakeSlabs(const Building& building, int* left_out = nullptr);

// The walls of a storey as areas: joined at corners, cut by their openings.

// A wall, in metres: from start to end along its face, behind which, to the left of that direction,
// it has its thickness.
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

// Those of all walls of a building that have a length.
std::map<const PlanWall*, WallSolid> SolidsOfWalls(const Building& building);

// How the back of a wall goes beyond its face (negative: ends before it) at both ends, in metres
// along it: as it is joined to the next one at a corner. 0 at an end that an opening reaches.
struct WallBack {
  double before_start_m = 0, beyond_end_m = 0;
};
// Of a wall among those solids; 0 of one that is none.
WallBack ComputeBack(const PlanWall& wall, const std::map<const PlanWall*, WallSolid>& solids);

// The stretches of a wall between its openings, in metres from its start.
std::vector<std::pair<double, double>> Intervals(const WallSolid& solid);

// The area of a stretch of a wall, counter-clockwise.
Polygon MakePiece(const WallSolid& solid, double from_m, double to_m);

// The area of walls, without their openings.
std::vector<Polygon> WallAreas(const std::vector<WallSolid>& solids);

// Whether a point on the border of walls is on no more than backs whose thickness was assumed.
bool IsAssumedBorder(const std::vector<WallSolid>& solids, const Eigen::Vector2d& point);

// The borders of those areas, once each; walls that overlap are one.
std::vector<WallEdge> WallEdges(const std::vector<WallSolid>& solids);

// Of the walls and rooms of all storeys; empty where there are none.
Eigen::AlignedBox2d PlanExtent(const Building& building);

}  // namespace slcmap::exporting
