// All lines of a building, from the images of the views.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "data/progress.h"
#include "mapping/line_evidence.h"
#include "mapping/lines/building_axes.h"
#include "mapping/lines/line_options.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/sight_depths.h"
#include "mapping/views/view.h"

namespace slcmap {

// The axes of a building of which only views are known: those of the lines in some of them.
std::vector<BuildingAxis> AxesOfViews(const Views& views, const ViewImages& images,
                                      const MapLineOptions& options, const Progress& progress = {});

// What a map says of lines: a line with several intervals is several MapLines with one id, which
// counts from 0.
std::vector<MapLine> AsMapLines(const std::vector<TrackedLine>& lines,
                                const std::vector<BuildingAxis>& axes,
                                const MapLineOptions& options);

// Those that are marks, which are taken out.
std::vector<MapLine> TakeMarks(std::vector<MapLine>* lines);

struct BuiltLines {
  std::vector<MapLine> lines;
  LineEvidence evidence;
};

// Starts from the lines that are known, finds more in the views, looks for all of them in all
// views, and once more for those that this moved, finds the intervals that they are in, and merges
// those that are one. The same views give the same lines, whatever the number of threads. Once
// progress says so, the lines are those that were found so far.
BuiltLines BuildLines(const Views& views, const ViewImages& images,
                      const std::vector<BuildingAxis>& axes, std::vector<TrackedLine> known,
                      const SightDepths& sights, const LineSurfaces& surfaces,
                      const MapLineOptions& options, const Progress& progress = {});

}  // namespace slcmap
