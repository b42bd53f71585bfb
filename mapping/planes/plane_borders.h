// Lines on a plane, at which its surface may end.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/planes/plane_grid.h"

namespace slcmap {

class PlaneBorders {
 public:
  PlaneBorders() = default;  // part nothing
  // The lines along a plane, at most beside_m off it; but marks and pipes.
  PlaneBorders(const PlaneGrid& grid, const std::vector<MapLine>& lines, double beside_m);

  // Whether one of them is between two places, in units of cells (column, row).
  bool Part(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;

 private:
  struct Border {
    Eigen::Vector2d start, end;
  };
  std::vector<Border> borders_;
};

}  // namespace slcmap
