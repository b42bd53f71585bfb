// What lines tell of the directions of those near them.
#pragma once

#include <optional>
#include <vector>

#include "mapping/lines/building_axes.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/neighbour_options.h"

namespace slcmap {

// By line, what the others of its axis make known of its direction beforehand: the mean and the
// standard deviation of a Gaussian process, given what each one's places tell of its direction.
// Those that are far from the axis count little. Nothing of lines without an axis.
std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options);

}  // namespace slcmap
