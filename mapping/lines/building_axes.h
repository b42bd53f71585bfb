// The directions that lines of a building run along.
#pragma once

#include <optional>
#include <vector>

#include "data/types.h"
#include "odometry/run.h"

namespace slcmap {

struct BuildingAxis {
  LineAxis axis = LineAxis::kVertical;
  int world = -1;    // as Line::world
  int segment = -1;  // of the run that it holds in; -1: all
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();
  double sigma_rad = 0;  // of a line's direction from it
};

// The vertical, then X and Y of the run's Manhattan worlds and its slopes, but those withdrawn.
// Where the run took lines to be exactly along their axes, they are so up to min_sigma_rad.
std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad);

}  // namespace slcmap
