// Lines that are one of many beside each other.
#pragma once

#include <vector>

#include "mapping/lines/line_store.h"

namespace slcmap {

// Counts, for each line, those that run beside it in one plane with it, as the joints of a brick
// wall do: within reach_m (half a metre at most), parallel, each at its own distance; the plane is
// the one that has most of them, give or take 3 cm. The median over places every 10 to 20 cm, as
// TrackedLine::parallels.
void CountParallels(double reach_m, std::vector<TrackedLine>* lines);

}  // namespace slcmap
