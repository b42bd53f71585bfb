// Polygons of a plan, or of a wall's face, as triangles (GEOS).
#pragma once

#include <array>
#include <vector>

#include "data/polygon.h"

namespace slcmap {

using PlanTriangle = std::array<Eigen::Vector2d, 3>;  // counter-clockwise

// A polygon without the areas of others, which may touch or cross its outline. None where nothing
// is left, or where outlines cross themselves.
std::vector<Polygon> Difference(const Polygon& polygon, const std::vector<PlanPoints>& areas);

// The constrained Delaunay triangulation, which adds no points. None of an outline that crosses
// itself.
std::vector<PlanTriangle> Triangulate(const Polygon& polygon);

}  // namespace slcmap
