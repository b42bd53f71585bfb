// Lines that no edge of the building is.
#pragma once

#include <vector>

#include "mapping/lines/line_options.h"
#include "mapping/lines/line_store.h"

namespace slcmap {

// Drops lines in the air. Where two parallel edges are taken for one, the left images' one for the
// right images' other, all views on a way along them agree on a line beside them. It has no known
// surface beside it, views that lie in one plane with it, and the edges that these show of it are
// those that they show of lines that are no ghosts.
void DropGhosts(const MapLineOptions& options, std::vector<TrackedLine>* lines);

}  // namespace slcmap
