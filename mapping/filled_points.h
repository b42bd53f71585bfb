// The points of planes that were filled, in a map.
#pragma once

#include <vector>

#include "mapping/map.h"

namespace slcmap {

// Into the dense cloud and, as patches of surfaces spacing_m wide, into the occupancy.
void AddFilledPoints(const std::vector<DensePoint>& filled, double spacing_m, MapResult* map);

// From the dense cloud. The occupancy keeps what they said.
void RemoveFilledPoints(MapResult* map);

}  // namespace slcmap
