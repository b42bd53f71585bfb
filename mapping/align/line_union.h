// The lines and the pipes of two maps as those of one.
#pragma once

#include <vector>

#include "data/io/map_line.h"
#include "mapping/lines/map_lines.h"
#include "mapping/lines/options.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

// Both are in one world. Lines that are one within what is known of both, and within alignment_m,
// become one line as mapping/lines/line_merging merges them: where the best known is, with the
// pieces, supports and observations of all. Its kind is what most of their length says. Axes of the
// second that are those of the first get their numbers. Ids count from 0.
LinesOfMap UniteLines(const LinesOfMap& first, const LinesOfMap& second, double alignment_m);

// Both are in one world. Pipes that lie along each other, with axes and radii that agree, become
// one: the best known, as far as either was seen. A pipe of the second is along the axis that the
// lines of the united map have there, or none. Ids count from 0.
std::vector<MapPipe> UnitePipes(std::vector<MapPipe> first, const std::vector<MapPipe>& second,
                                const std::vector<MapLine>& lines);

}  // namespace slcmap::mapping
