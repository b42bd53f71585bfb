// The guided pass: all views are looked at for the lines that are known; and what lines tell of the
// directions of those near them.
#pragma once

#include <optional>
#include <vector>

#include "data/core/progress.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/options.h"

namespace slcmap::inline mapping {

// By line, what the others of its axis and segment make known of its direction beforehand: the mean
// and the standard deviation that a Gaussian process predicts from what each one's places tell of
// its direction. Those that are far from the axis count little. Nothing of lines without an axis.
// The lines' last fits are with the prior of their axis (its direction, sigma_rad).
std::vector<std::optional<DirectionPrior>> PriorsByNeighbours(const std::vector<TrackedLine>& lines,
                                                              const std::vector<BuildingAxis>& axes,
                                                              const NeighbourOptions& options);

// Looks for each line, a good deal beyond its ends, in both images of every view of its segment:
// afterwards, but where surfaces hide it, its bins say how many views look at each piece of it and
// how many of them show an edge there, and its places where that is. Once progress says so, later
// views are left out.
void LookForLines(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
                  const MapLineOptions& options, std::vector<TrackedLine>* lines,
                  const Progress& progress);

// The intervals of a line in which enough of the views show its edge, by its bins.
std::vector<Interval> FindIntervals(const TrackedLine& line);

// Fits the lines again to their places in their intervals; those that do not hold are dropped.
void FitAgain(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
              const MapLineOptions& options, std::vector<TrackedLine>* lines);

// A line that the fit moved was in part taken for edges beside it, or was not looked at where it
// is: those are looked for and fitted once more, and dropped if they do not hold there. Once
// progress says so, they stay as they were.
void LookAgain(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
               const std::vector<BuildingAxis>& axes, const MapLineOptions& options,
               std::vector<TrackedLine>* lines, const Progress& progress);

// Fits the lines of each axis once more, each with what those near it make known of its direction
//; what does not hold so stays as it was.
void FitAmongNeighbours(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
                        const MapLineOptions& options, std::vector<TrackedLine>* lines);

}  // namespace slcmap::mapping
