// The walls of a map, to be surveyed from its cloud: from points that nothing laid on a plane.
#pragma once

#include <vector>

#include "apps/evaluation/wall_survey.h"
#include "mapping/building/building.h"
#include "mapping/dense/dense_point.h"

namespace slcmap {

struct MapWallOptions {
  double max_distance_m = 0.05;  // of a point from the plane that says which wall it is of
  double max_angle_deg = 20;     // between their normals
  void Check() const;            // throws ConfigError
};

// The points of stereo depth that lie over each plane of a wall, within the extents of its outline.
// Of filled planes there are none: they lie on the plane by construction. Walls have the numbers
// that plans, the page and IFC give them, and may have several faces; planes of none have -1.
std::vector<SurveyedPoints> WallsOfMap(const Building& building,
                                       const std::vector<DensePoint>& cloud,
                                       const MapWallOptions& options);

}  // namespace slcmap
