// Storeys as a map would have them, made straight from a plan: what a walk sees of its walls, with
// noise, and with walls that are not where they were planned.
#pragma once

#include <vector>

#include "mapping/plan/plan_placement.h"

namespace slcmap::testing {

struct BuildOtherwise {
  unsigned seed = 1;
  double sigma_m = 0.004;        // of offsets of faces
  double deviating_share = 0.3;  // of faces of a metre or more: 5 to 50 mm, either way
  PlanPose T_plan_world{0.7, {3, -2}};
};

struct MadeStorey {
  BuiltStorey storey;               // planes are numbers of the plan's faces
  std::vector<double> deviation_m;  // of each of the plan's faces
};

// Of a walk from corner to corner, in the plan's coordinates.
MadeStorey BuildFromPlan(const BuildingPlan& plan, const std::vector<Eigen::Vector2d>& walk,
                         const BuildOtherwise& how);

// An office floor: a corridor between rooms of different widths, with doors, and a wing that is
// turned by 30 degrees. Rebuilt, it lacks kLackingWall and has kNewWalls; their middles.
BuildingPlan MakeOfficePlan(bool is_rebuilt = false);
inline const Eigen::Vector2d kLackingWall{7.7, 2.95};
inline const std::vector<Eigen::Vector2d> kNewWalls = {{2, 3}, {11, 12.5}};

// Along the corridor, into all rooms and the wing.
std::vector<Eigen::Vector2d> WalkThroughOffice();

}  // namespace slcmap::testing
