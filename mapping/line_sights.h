// What views saw of the lines of a map: ways that are free.
#pragma once

#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/map.h"

namespace slcmap {

// Rays from each image that shows lines or marks of a map to places along what it shows of them, by
// stamp and camera. Where walls are blank and stereo measures nothing, these are what is known to
// be free. Their ends are as uncertain as their lines, and at least as uncertain as lines are that
// turn out a little wrong.
std::vector<Sights> SightsOfLines(const MapResult& map);

}  // namespace slcmap
