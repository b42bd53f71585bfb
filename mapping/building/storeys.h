// Storeys: where the trajectory has a floor beneath it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "mapping/building/building_input.h"

namespace slcmap {

// The part of a building over one floor. Metres, in world.
struct Level {
  double floor_m = 0;
  std::optional<double> ceiling_m;      // nothing where none was seen
  double top_m = 0;                     // the ceiling, else as high as anything upright was seen
  std::vector<Eigen::Vector3d> places;  // of the trajectory, thinned
};

// From the lowest floor. A storey is a height at which the trajectory has level ground beneath it
// (histogram at 2 cm, in which each place of the plan counts once), and which it follows: what is
// only flown over, as a table, is none. Its ceiling is what is above most of it. There is at least
// one where there is a trajectory; a floor that was not seen is taken to be where walls end.
std::vector<Level> FindLevels(const BuildingInput& input);

// The storey that a point belongs to, -1: none. Where heights overlap, as those of a split level
// do, it is that whose part of the trajectory is nearer in the plan.
int LevelAt(const std::vector<Level>& levels, const Eigen::Vector3d& p_world);

}  // namespace slcmap
