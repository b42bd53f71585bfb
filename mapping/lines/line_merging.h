// Takes lines that are one edge together, and finds the intervals of a line whose places are of one
// edge.
#pragma once

#include <optional>
#include <vector>

#include "mapping/lines/line_store.h"
#include "mapping/lines/options.h"

namespace slcmap::inline mapping {

// What a line is kept with.
struct IntervalLimits {
  int min_views = 0;
  double max_sigma_m = 0, max_spread_px = 0;
  double min_length_m = 0;  // of an interval
  bool Hold(const LineFit& fit) const;
};

// Fits a line to its places in its intervals. Where these scatter by more than max_spread_px, by
// their median, the line may pass one edge here and another there: the intervals that scatter least
// are fitted alone, and those that agree with them are kept; of a line that holds as a whole, those
// that scatter by half as much again. Intervals and places of others leave the line where the rest
// holds. Nothing where no line can be fitted; a fit that does not hold is returned as it is.
std::optional<LineFit> FitIntervals(const ViewCameras& cameras,
                                    const std::optional<DirectionPrior>& prior,
                                    const LineFitOptions& options, const IntervalLimits& limits,
                                    TrackedLine* line);

// One interval where they overlap or are next to each other but for a gap; sorted.
std::vector<Interval> Union(std::vector<Interval> intervals, double max_gap_m);

// Leaves the places in the intervals.
void DropPlacesOutside(TrackedLine* line);

// Merges lines of one axis that lie beside each other within what is known of them: each with all
// of its group (full linkage), the best known first, so that chains of neighbours do not grow
// together. Lines of different maps are known against each other to between_maps_m at best.
std::vector<TrackedLine> MergeLines(std::vector<TrackedLine> lines, double between_maps_m = 0);

}  // namespace slcmap::mapping
