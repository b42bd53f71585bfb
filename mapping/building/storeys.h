// Storeys: where the trajectory has a floor beneath it; and columns of the plan, by which surfaces
// above each other are found.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/map/building.h"

namespace slcmap::inline mapping {

inline constexpr double kColumn_m = 0.25;  // its side
inline constexpr double kHung_m = 0.6;     // from what hangs to the ceiling above it, at most
inline constexpr size_t kHungOver = 4;  // columns of what hangs over those of the ceiling, at most
inline constexpr double kLevelCosine = 0.96;  // of surfaces that count as level, 16 degrees

using PlanColumn = std::pair<int, int>;

inline PlanColumn FindColumn(const Eigen::Vector2d& p) {
  return {static_cast<int>(std::floor(p.x() / kColumn_m)),
          static_cast<int>(std::floor(p.y() / kColumn_m))};
}

// The part of a building over one floor. Metres, in world.
struct Level {
  double floor_m = 0;
  std::optional<double> ceiling_m;      // nothing where neither it nor its edges were seen
  double top_m = 0;                     // the ceiling, else as high as anything upright was seen
  std::vector<Eigen::Vector3d> places;  // of the trajectory, thinned
};

// From the lowest floor. A storey is a height at which the trajectory has level ground beneath it
// (histogram at 2 cm, in which each place of the plan counts once), and which it follows: what is
// only flown over, as a table, is none. Its ceiling is what is above most of it, or where edges
// end. There is at least one where there is a trajectory; a floor that was not seen is taken to be
// where walls end.
std::vector<Level> FindLevels(const BuildingInput& input);

// The storey that a point belongs to, -1: none. Where heights overlap, as those of a split level
// do, it is that whose part of the trajectory is nearer in the plan.
int LevelAt(const std::vector<Level>& levels, const Eigen::Vector3d& p_world);

}  // namespace slcmap::mapping
