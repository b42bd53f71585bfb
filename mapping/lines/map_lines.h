// All lines of a building, from the images of the views: what the line stage starts from, and what
// is known of lines when they become those of a map.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "data/io/map_line.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/options.h"
#include "mapping/map/map.h"
#include "mapping/views/view.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// Those of the run's lines that are known to max_sigma_m and were seen by min_views keyframes, each
// running so that the bright side is on the left of its image. Axes are those of AxesOfRun.
std::vector<TrackedLine> KnownLines(const OdometryRun& run, const std::vector<BuildingAxis>& axes,
                                    double max_sigma_m, int min_views);

// Of lines whose ids count from 0, and whose intervals are their pieces. A support is the straight
// line that fits the places of a piece in one image, as far as they reach.
LineEvidence CollectEvidence(const std::vector<TrackedLine>& lines, const Views& views,
                             const ViewCameras& cameras);

// The axes of a building of which only views are known: those of the lines in some of them.
std::vector<BuildingAxis> AxesOfViews(const Views& views, const ViewImages& images,
                                      const MapLineOptions& options, const Progress& progress = {});

// What a map says of lines: a line with several intervals is several MapLines with one id, which
// counts from 0.
std::vector<MapLine> AsMapLines(const std::vector<TrackedLine>& lines,
                                const std::vector<BuildingAxis>& axes);

// Those that are marks, which are taken out.
std::vector<MapLine> TakeMarks(std::vector<MapLine>* lines);

// The lines of a map, marks among them, and what is known of them.
struct LinesOfMap {
  std::vector<MapLine> lines;
  LineEvidence evidence;
};

// Starts from the lines that are known, finds more in the views, looks for all of them in all
// views, finds the intervals that they are in, merges those that are one, and collects what tells
// of each whether it is an edge. The same views give the same lines, whatever the number of
// threads. Once progress says so, the lines are those that were found so far.
std::vector<TrackedLine> TrackLines(const Views& views, const ViewImages& images,
                                    const std::vector<BuildingAxis>& axes,
                                    std::vector<TrackedLine> known, const VisibilityDepths& depths,
                                    const LineSurfaces& surfaces, const MapLineOptions& options,
                                    const Progress& progress = {});

// The same as a map says it.
LinesOfMap BuildLines(const Views& views, const ViewImages& images,
                      const std::vector<BuildingAxis>& axes, std::vector<TrackedLine> known,
                      const VisibilityDepths& depths, const LineSurfaces& surfaces,
                      const MapLineOptions& options, const Progress& progress = {});

// Looks for each line, a good deal beyond its ends, in both images of every view of its segment:
// afterwards, but where surfaces hide it, its bins say how many views look at each piece of it and
// how many of them show an edge there, and its places where that is. Once progress says so, later
// views are left out.
void LookForLines(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
                  const MapLineOptions& options, std::vector<TrackedLine>* lines,
                  const Progress& progress);

// The intervals of a line in which enough of the views show its edge, by its bins.
std::vector<Interval> FindIntervals(const TrackedLine& line);

// Fits the lines to their places in their intervals; those that do not hold are dropped.
void FitLines(const Views& views, const Rig& rig, const std::vector<BuildingAxis>& axes,
              const MapLineOptions& options, std::vector<TrackedLine>* lines);

}  // namespace slcmap::mapping
