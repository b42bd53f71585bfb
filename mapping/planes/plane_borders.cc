#include "mapping/planes/plane_borders.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d CellOf(const PlaneGrid& grid, const Vector3d& p) {
  return {(grid.u.dot(p) - grid.from_u_m) / grid.cell_m,
          (grid.v.dot(p) - grid.from_v_m) / grid.cell_m};
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Whether p and q lie on different sides of the line through a and b.
bool AreApart(const Vector2d& a, const Vector2d& b, const Vector2d& p, const Vector2d& q) {
  return Cross(b - a, p - a) * Cross(b - a, q - a) < 0;
}

}  // namespace

PlaneBorders::PlaneBorders(const PlaneGrid& grid, const std::vector<MapLine>& lines,
                           double beside_m) {
  for (const MapLine& line : lines) {
    if (line.kind == LineKind::kMark || line.kind == LineKind::kPipe ||
        std::abs(grid.DistanceTo(line.start_world)) > beside_m ||
        std::abs(grid.DistanceTo(line.end_world)) > beside_m) {
      continue;
    }
    borders_.push_back({CellOf(grid, line.start_world), CellOf(grid, line.end_world)});
  }
}

bool PlaneBorders::Part(const Vector2d& a, const Vector2d& b) const {
  return std::any_of(borders_.begin(), borders_.end(), [&](const Border& border) {
    return AreApart(border.start, border.end, a, b) && AreApart(a, b, border.start, border.end);
  });
}

}  // namespace slcmap
