// What lines tell of the directions of those near them.
#pragma once

#include <optional>
#include <vector>

#include "mapping/lines/building_axes.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/neighbour_options.h"

namespace slcmap {

// By line, what the others of its axis and segment make known of its direction beforehand: the mean
// and the standard deviation that a Gaussian process predicts from what each one's places tell of
// its direction. Those that are far from the axis count little. Nothing of lines without an axis.
// The lines' last fits are with the prior of their axis (its direction, sigma_rad).
std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options);

}  // namespace slcmap
