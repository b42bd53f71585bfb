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
// Lines may be off them by 1.4 times what the run has learned of its building, and by min_sigma_rad
// at least.
std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad);

// A line whose direction counts towards that of the building.
struct DirectedLine {
  Eigen::Vector3d direction_world;  // unit, either way round
  double length_m = 0;
  double sigma_rad = 0;
};

struct AxisDetectionOptions {
  double max_tilt_rad = 0.07;  // of the building's vertical from the world's z
  double window_rad = 0.02;    // headings within it of each other are one
  double min_length_m = 5;     // of lines that follow an axis
  double min_share = 0.2;      // of the length along the heading that most follow
  // Times what would follow a heading if the level lines had any: in a furnished room each has
  // some.
  double min_over_chance = 2.5;
  double min_apart_rad = 0.05;  // between headings
  double sigma_rad = 0.003;     // of lines from their axis
};

// The axes of a building whose lines are known and whose heading is not: the vertical, which is the
// mean of the lines near the world's z, and the headings that the level lines share (to a quarter
// turn), those with most length first. Without lines the vertical alone, which is z.
std::vector<BuildingAxis> FindAxes(const std::vector<DirectedLine>& lines,
                                   const AxisDetectionOptions& options = {});

}  // namespace slcmap
