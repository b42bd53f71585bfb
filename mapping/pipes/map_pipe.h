// A pipe of a map: a straight round thing.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "data/types.h"

namespace slcmap {

struct MapPipe {
  int64_t id = 0;
  int segment = 0;  // of the run
  LineAxis axis = LineAxis::kNone;
  int world = -1;                                         // as of a line (data/map_line.h)
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();  // of its axis, as far as it was seen
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  double radius_m = 0;
  double sigma_m = 0;         // standard deviation of the axis across it, where that is largest
  double radius_sigma_m = 0;  // of the radius
  int images = 0;             // that show an outline of it
};

}  // namespace slcmap
