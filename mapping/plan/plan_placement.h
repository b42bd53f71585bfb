// Where a storey of a map lies in a plan of it.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "data/core/error.h"
#include "data/core/progress.h"
#include "mapping/align/align_maps.h"
#include "mapping/map/building.h"
#include "mapping/map/occupancy_map.h"
#include "mapping/plan/building_plan.h"

namespace slcmap::inline mapping {

inline constexpr double kPlanSample_m = 0.05;  // along faces
inline constexpr double kBehindFace_m = 0.12;  // beyond what cells of free space are off
inline constexpr double kSameWall_m = 0.25;    // across: what is farther off is another one

// A wall's face as a map has it; ids of the plane. Metres, in world.
struct MappedFace {
  PlannedFace face;
  int64_t plane = -1;
  // Of as many equal parts, from its start, whether something was measured of them; none: of all. A
  // plane goes on across niches, and behind what stands before it.
  std::vector<bool> measured = {};

  bool IsMeasuredAt(double share) const {
    const auto at = static_cast<std::size_t>(share * static_cast<double>(measured.size()));
    return measured.empty() || measured[std::min(at, measured.size() - 1)];
  }
};

struct BuiltOpening {
  PlannedOpening opening;
  int64_t wall = -1;
};

// Where nothing stands at the height of people, by cells of the plan.
struct FreeCells {
  Eigen::Vector2d least = Eigen::Vector2d::Zero();
  double cell_m = 0.1;
  cv::Mat1b free;  // a row a y; 1: nothing stands there

  bool IsFree(const Eigen::Vector2d& p) const;
};

struct BuiltStorey {
  int64_t id = 0;
  std::vector<MappedFace> faces;
  std::vector<BuiltOpening> openings;
  std::vector<Eigen::Vector2d> trajectory;
  FreeCells free;
};

// A turn, then a shift.
struct PlanPose {
  double yaw_rad = 0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Eigen::Vector2d Turn(const Eigen::Vector2d& v) const;
  Eigen::Vector2d operator*(const Eigen::Vector2d& p) const { return Turn(p) + shift; }
};

struct PlanPlacement {
  PlanPose T_plan_world;
  // Of x, y and yaw about `middle` (in the plan): how well the place is known.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double agreeing_m = 0, differing_m = 0;  // lengths of faces
  double score_m = 0, rival_share = 0;
  std::optional<PlanPose> rival;

  double AgreeingShare() const { return agreeing_m / (agreeing_m + differing_m + 1e-9); }
  // Of an offset along a direction at a place.
  double SigmaAt(const Eigen::Vector2d& p, const Eigen::Vector2d& normal) const;
};

// The best place, and the next best one that is another. With a rough start those within its
// reach. Nothing where headings or walls are missing.
std::optional<PlanPlacement> FindPlacement(const BuiltStorey& built, const BuildingPlan& plan,
                                           const std::optional<RoughStart>& start,
                                           const Progress& progress = {});

// How many times as large the plan fits clearly better, if it does so: its scale may be wrong.
std::optional<double> FindBetterScale(const BuiltStorey& built, const BuildingPlan& plan,
                                      const PlanPlacement& placement);

// Throws DataError where a placement is none: too little agrees, or as much elsewhere; with what
// helps. The mirrored plan and other scales are tried to tell that, unless the place was told about
// and fits.
void RequirePlacement(const BuiltStorey& built, const BuildingPlan& plan,
                      const std::optional<PlanPlacement>& placement, bool is_told = false);

}  // namespace slcmap::mapping
