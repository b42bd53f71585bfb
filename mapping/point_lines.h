// Which lines the points of the cloud lie on.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/map.h"

namespace slcmap {

// Sets line_id of all points: the nearest line of those within three standard deviations of both
// together, and within 4 cm; -1 where there is none.
void FindLinesOfPoints(const std::vector<MapLine>& lines, std::vector<MapPoint>* points);

}  // namespace slcmap
