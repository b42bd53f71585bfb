// Takes lines that are one edge together.
#pragma once

#include <vector>

#include "mapping/lines/line_options.h"
#include "mapping/lines/line_store.h"

namespace slcmap {

// Merges lines of one axis that lie beside each other within what is known of them: each with all
// of its group (full linkage), the best known first, so that chains of neighbours do not grow
// together. Lines of different maps are known against each other to between_maps_m at best.
std::vector<TrackedLine> MergeLines(std::vector<TrackedLine> lines,
                                    const LineMergingOptions& options, double between_maps_m = 0);

}  // namespace slcmap
