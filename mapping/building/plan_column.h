// Columns that the plan is divided into, by which surfaces above each other are found.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace slcmap {

inline constexpr double kColumn_m = 0.25;  // its side
inline constexpr double kHung_m = 0.6;     // from what hangs to the ceiling above it, at most
inline constexpr size_t kHungOver = 4;  // columns of what hangs over those of the ceiling, at most
inline constexpr double kLevelCosine = 0.96;  // of surfaces that count as level, 16 degrees

using PlanColumn = std::pair<int, int>;

inline PlanColumn ColumnOf(const Eigen::Vector2d& p) {
  return {static_cast<int>(std::floor(p.x() / kColumn_m)),
          static_cast<int>(std::floor(p.y() / kColumn_m))};
}

}  // namespace slcmap
