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
  double missing_share = 0, extra_walls = 0;
  double range_m = 8;
  PlanPose T_plan_world{0.7, {3, -2}};
};

struct MadeStorey {
  BuiltStorey storey;
  BuildOtherwise how;
  std::vector<std::size_t> planned;  // the face of each built one; those of extra walls: the count
  std::vector<double> deviation_m;   // of each built face
  std::vector<std::size_t> missing;  // planned faces that were left out, and would have been seen
};

// Of a walk in the plan's coordinates.
MadeStorey BuildFromPlan(const BuildingPlan& plan, const std::vector<Eigen::Vector2d>& walk,
                         const BuildOtherwise& how);

// A walk from a free place through what one gets to from there, to places far from those before.
std::vector<Eigen::Vector2d> InventWalk(const BuildingPlan& plan, const Eigen::Vector2d& start,
                                        double length_m, unsigned seed);

// An office floor: a corridor between rooms of different widths, with doors, and a wing that is
// turned by 30 degrees.
BuildingPlan MakeOfficePlan();
inline const Eigen::Vector2d kOfficeStart{2, 7};

}  // namespace slcmap::testing
