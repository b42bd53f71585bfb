// Columns that the plan is divided into, by which surfaces above each other are found.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace slcmap {

inline constexpr double kColumn_m = 0.25;     // its side
inline constexpr double kLevelCosine = 0.96;  // of surfaces that count as level, 16 degrees

using PlanColumn = std::pair<int, int>;

inline PlanColumn ColumnOf(const Eigen::Vector2d& p) {
  return {static_cast<int>(std::floor(p.x() / kColumn_m)),
          static_cast<int>(std::floor(p.y() / kColumn_m))};
}

}  // namespace slcmap
