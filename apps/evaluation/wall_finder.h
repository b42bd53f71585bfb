// Which points of a run lie on which wall: found once, for all trajectories of a sequence.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/evaluation/reference_observations.h"
#include "apps/evaluation/wall_survey.h"

namespace slcmap {

struct WallFinderOptions {
  double thickness_m = 0.04;  // a point of a wall is at most so far from its middle
  double max_sigma_m = 0.03;  // of a point across it
  double max_gap_m = 1.5;     // along it between points
  double min_length_m = 2, min_height_m = 0.8;
  int min_points = 60;
  void Check() const;  // throws ConfigError
};

// Indices of points that lie on one face of a wall.
struct FoundWall {
  int64_t wall = 0;
  std::vector<size_t> points;
};

// Looks for upright planes square to `axes` (columns; those that are nearly level) among points
// with the poses of one trajectory. Points on both sides of a wall are of two.
std::vector<FoundWall> FindWalls(const std::vector<PointOfPair>& points,
                                 const Trajectory& trajectory, const Eigen::Matrix3d& axes,
                                 const WallFinderOptions& options);

// The points of the walls with the poses of another trajectory, to be surveyed. What it has no pose
// for is left out.
std::vector<SurveyedPoints> PlaceWalls(const std::vector<FoundWall>& walls,
                                       const std::vector<PointOfPair>& points,
                                       const Trajectory& trajectory);

}  // namespace slcmap
