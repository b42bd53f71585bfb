// Areas of a plane as triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/polygon.h"

namespace slcmap {

using PlanTriangle = std::array<Eigen::Vector2d, 3>;  // counter-clockwise

// What an outline encloses, without what the cuts enclose, as a constrained Delaunay triangulation.
// Outlines may go either way round and cross themselves; cuts may touch each other and reach beyond
// the outline. Points come to lie on a grid. Deterministic. Throws DataError for coordinates that
// are not finite.
std::vector<PlanTriangle> Triangulate(const PlanPoints& outline,
                                      const std::vector<PlanPoints>& cuts, double grid_m);

}  // namespace slcmap
