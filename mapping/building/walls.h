// Walls as solids: opposite faces of one wall belong together.
#pragma once

#include <vector>

#include "mapping/building/openings.h"
#include "mapping/building/rooms.h"
#include "mapping/building/storeys.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

// A wall's face with what is on it.
struct BuiltFace {
  WallFace wall;
  std::vector<FaceOpening> openings;
  int64_t plane_id = 0;
  bool is_wall = false;
  // Nobody saw it: it is the back of a wall, and before it is a room.
  bool is_inferred = false;
};

// Of parallel faces one of which is just behind another, as a pane behind its wall, a duct before
// it, only that is the wall's which is one in more places: the others have no share of a wall
// there. What stands from floor to top before another hides it. What is shorter than 1.5 m is a
// wall only where it nearly reaches the floor and either has its other side right behind it, or
// reaches the top of its storey along or across a long one. Sets which faces, all of one storey,
// are of walls.
void SelectWalls(const Level& level, std::vector<BuiltFace>* faces);

// What looks like an opening, but has a wall just behind it, is a niche; and a passage beyond which
// hardly anything stands is where a wall ends: walls are cut there.
void CutAtGaps(const Level& level, std::vector<BuiltFace>* faces);

// How far a way in the plan leads before it comes to the front of a wall that it cannot pass, as a
// share of it. Doors and passages let it through; what is seen through a window is outside.
double ShareBeforeWalls(const std::vector<BuiltFace>& faces, const Eigen::Vector2d& from,
                        const Eigen::Vector2d& to);

// Moves the ends of walls to the walls that they end at: to where the planes cross, where that is
// near a measured end of either.
void CloseCorners(std::vector<BuiltFace>* faces);

// The walls of the plan. Faces that look away from each other, between the least and the largest
// thickness apart and beside each other, are sides of one wall: it has the longer one's line.
// The others get the typical thickness of the building behind what was measured.
std::vector<PlanWall> PlanWalls(const std::vector<BuiltFace>& faces,
                                const std::vector<Level>& levels, const BuildingOptions& options);

}  // namespace slcmap::mapping
