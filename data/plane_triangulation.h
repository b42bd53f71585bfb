// Areas of a plane with parts cut out, and as triangles (GEOS). Metres, in the plane.
// Deterministic.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/polygon.h"

namespace slcmap {

using PlanTriangle = std::array<Eigen::Vector2d, 3>;  // counter-clockwise

// A polygon without what the cuts enclose, which may touch each other and reach beyond its outline;
// none where nothing is left. Outlines may go either way round; of one that crosses itself it is
// what it encloses. Points come to lie on a grid. Throws DataError for coordinates that are not
// finite.
std::vector<Polygon> Difference(const Polygon& polygon, const std::vector<PlanPoints>& cuts,
                                double grid_m = 1e-6);

// The constrained Delaunay triangulation, which adds no points. As Difference otherwise.
std::vector<PlanTriangle> Triangulate(const Polygon& polygon);

}  // namespace slcmap
