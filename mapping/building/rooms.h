// Rooms of a storey: cells between the lines of its walls, labelled by a graph cut.
#pragma once

#include <vector>

#include "mapping/building/faces.h"
#include "mapping/building/free_space.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

// A face of a wall with what is known of it along its line, in steps of step_m from face.from_m:
// the share of each, 0 to 1, that is sure to be a wall.
struct WallFace {
  Face face;
  std::vector<double> shares;
  double step_m = 0.05;
  double measured_m = 0;            // of its length, without what was not seen between
  std::vector<bool> is_solid = {};  // of each step: from floor to top, hardly a ray went through
  // Along the face, where rooms are looked for: doors, and gaps from floor to top.
  std::vector<Interval> doors = {}, gaps = {};
};

// What a room is in the plan.
struct FoundRoom {
  Polygon polygon;
  double bounded = 0;  // share of its border on which a wall was measured
};

// The arrangement of the lines of walls, also of those that nobody saw, extended; of its
// cells, those are inside that rays went through, smoothly (minimum cut: a cell costs its area that
// is labelled wrongly, a border between inside and outside its length where no wall is). Rooms
// are inside cells that open borders connect; walls and their openings part them. By the first
// point of their outline.
std::vector<FoundRoom> FindRooms(const std::vector<WallFace>& walls, const FreeSpace& free,
                                 const BuildingOptions& options);

}  // namespace slcmap::mapping
