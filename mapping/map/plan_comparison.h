// How a map lies in a plan of its building, and what was built otherwise than it was planned; and
// its files in a map folder. mapping/FORMAT.md describes them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/rigid_transform.h"

namespace slcmap::inline mapping {

enum class PlanStatus { kAsPlanned, kDeviates, kMissing, kNew };
inline constexpr std::array<const char*, 4> kPlanStatuses = {"as_planned", "deviates", "missing",
                                                             "new"};
inline const char* GetName(PlanStatus status) {
  return kPlanStatuses[static_cast<std::size_t>(status)];
}

// A stretch of a wall's face: where it was planned and seen, or of a new one where it is. Its ends
// are in the plan's coordinates, from left to right as seen from before it.
struct WallDeviation {
  PlanStatus status = PlanStatus::kAsPlanned;
  int64_t planned = -1, plane = -1;  // the plan's face, the map's plane; -1: none
  Eigen::Vector2d start_plan = Eigen::Vector2d::Zero(), end_plan = Eigen::Vector2d::Zero();
  // How far before the planned face, towards who looks at it, the built one is, in the middle, and
  // how it is turned against it, counter-clockwise; with all that is not known of face, plan and
  // placement.
  double deviation_m = 0, sigma_m = 0;
  double turn_rad = 0, turn_sigma_rad = 0;
};

// An opening; its ends are as planned, or of a new one as built. One that is missing is closed: by
// a wall or by a leaf.
struct OpeningDeviation {
  PlanStatus status = PlanStatus::kAsPlanned;
  int64_t planned = -1, wall = -1;  // the plan's opening, the map's wall; -1: none
  Eigen::Vector2d start_plan = Eigen::Vector2d::Zero(), end_plan = Eigen::Vector2d::Zero();
  // How far its middle is moved, from its start to its end, and how much wider it is.
  double moved_m = 0, moved_sigma_m = 0, wider_m = 0, wider_sigma_m = 0;
};

struct PlanComparison {
  std::string plan;            // file or folder
  std::string planned_storey;  // its name there
  int64_t storey = 0;          // of the map
  // The world of the map in the plan's coordinates: a turn about z, and a translation in x and y.
  RigidTransform T_plan_world;
  double sigma_m = 0, yaw_sigma_rad = 0;   // of the placement, at the middle of what was seen
  double agreeing_m = 0, differing_m = 0;  // lengths of walls
  double rival_share = 0;                  // of the next best place's score; 0: none
  std::vector<WallDeviation> walls;
  std::vector<OpeningDeviation> openings;
};

// plan_comparison.json, and the same as a table for people: plan_deviations.csv.
inline constexpr std::array<const char*, 2> kPlanComparisonFiles = {"plan_comparison.json",
                                                                    "plan_deviations.csv"};
void WritePlanComparison(const std::string& folder, const PlanComparison& comparison);

// Throws DataError naming the file and what is wrong in it.
PlanComparison ReadPlanComparison(const std::string& folder);

}  // namespace slcmap::mapping
