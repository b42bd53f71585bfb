// Lines on a surface that repeat at one distance: joints of bricks, tiles and boards.
#pragma once

#include <vector>

#include "data/io/map_line.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

// Finds the lines, of one direction of the building and in one plane, that lie at multiples of a
// distance from each other: more of them than lines that lie anywhere would. A line that is where
// the pattern has one is so much the rather a mark (MapLine::SetProbability). By plane, the
// patterns with most lines first.
std::vector<MapPattern> FindPatterns(std::vector<MapLine>* lines);

}  // namespace slcmap::mapping
