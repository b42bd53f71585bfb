// What of a storey was built otherwise than it was planned.
#pragma once

#include <optional>

#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/map.h"
#include "mapping/map/plan_comparison.h"
#include "mapping/plan/building_plan.h"
#include "mapping/plan/plan_placement.h"

namespace slcmap::inline mapping {

// Places the storey more closely: walls that are where they were planned say where, those that
// deviate do not. Then tells of each wall and opening that was seen how far it is off.
PlanComparison CompareWithPlan(const BuiltStorey& built, const BuildingPlan& plan,
                               const PlanPlacement& placement);

// The storey of a map as it is compared: the walls that somebody saw.
BuiltStorey MakeBuiltStorey(const MapResult& map, const Storey& storey);

// Finds the storeys of map and plan that fit best, and compares them. Throws DataError where the
// map has no place in the plan, or several, and StoppedError once progress says so.
PlanComparison RegisterToPlan(const MapResult& map, const std::vector<BuildingPlan>& plans,
                              const std::optional<RoughStart>& start,
                              const Progress& progress = {});

}  // namespace slcmap::mapping
