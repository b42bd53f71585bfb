// The surface of a face, behind what stands proud of it.
#pragma once

#include <vector>

#include "mapping/building/faces.h"

namespace slcmap::inline mapping {

// Brings a face to lie in the surface that its samples stand on or before. What is fixed to a wall,
// as skirtings, frames and signs are, stands before it by up to some centimetres, nothing behind
// it; and where plaster is blank, images show nothing else. So a sample is either on the surface,
// or before it by anything up to 4 cm or by what all trims of a wall stand before
// it, if points show that it has any, or stray; the offset is the mean of its posterior over these
// (a mixture of a normal density, that of a uniform one with noise, another normal one, and a
// uniform one) where trims stand out as far as is likeliest, the heading a least-squares fit to
// what is on it with as much weight. Points near each other err alike and count by area, lines by
// their length. The face moves by at most most_m at its middle; without samples it stays. Samples:
// those of its storey, in any order. Returns the standard deviation that this adds to that of the
// face's offset.
double MoveOntoSurface(const std::vector<FaceSample>& samples, double most_m, Face* face);

}  // namespace slcmap::mapping
