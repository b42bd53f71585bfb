// Places that are recognised by the edges of the building.
#pragma once

#include <vector>

#include "mapping/adjustment/closure.h"

namespace slcmap {

// Lines of one axis that lie near each other across it and were seen at different visits are
// candidates for one edge; those of which enough agree on one shift between the visits become a
// closure. Lines are merged by place and axis alone, whatever direction they are seen from.
std::vector<Closure> FindEdgeClosures(const AdjustmentState& state, const ClosureOptions& options);

}  // namespace slcmap
