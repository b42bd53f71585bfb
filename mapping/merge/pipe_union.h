// The pipes of two maps as those of one.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "mapping/pipes/map_pipe.h"

namespace slcmap {

// Both are in one world. Pipes that lie along each other, with axes and radii that agree, become
// one: the best known, as far as either was seen. A pipe of the second is along the axis that the
// lines of the united map have there, or none. Ids count from 0.
std::vector<MapPipe> UnitePipes(std::vector<MapPipe> first, const std::vector<MapPipe>& second,
                                const std::vector<MapLine>& lines);

}  // namespace slcmap
