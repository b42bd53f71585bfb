// Points of the dense cloud on the planes of the building.
#pragma once

#include <vector>

#include "mapping/building/building.h"
#include "mapping/dense/dense_point.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

// Draws points whose depth is uncertain to the wall, floor or ceiling that they lie on: a point at
// the distance d with the standard deviation s from a plane that surfaces follow to within p (of
// its offset, and surface_sigma_m) moves to d p^2 / (p^2 + s^2), the best of what stereo and the
// plane say. Points that face another way, are more than draw_sigmas off, or in an opening, stay.
// Of those that come to lie on a better known one the uncertain ones go. Planes that nobody
// measured draw nothing.
void DrawToPlanes(const Building& building, const PlaneOptions& options,
                  std::vector<DensePoint>* dense);

}  // namespace slcmap
