// What is reported of a run's lines: which were merged, their form in lines.ply, and how long they
// lived.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "odometry/run.h"

namespace slcmap {

// The standard deviation of a line across it, where that is largest, in metres.
double LargestSigma(const Line& line);

// Follows line_merges from line to line to the ones that remain, and gives the keyframes'
// observations their ids. Where a keyframe saw several lines that are now one, the observation of
// the oldest stays.
void ResolveMergedLines(OdometryRun* run);

// The run's lines in their order, without those of withdrawn Manhattan worlds; lines that one of
// the last ten keyframes saw are recent.
std::vector<MapLine> MapLines(const OdometryRun& run);

// In how many keyframes lines were seen; short lives mean that lines hardly help.
struct LineLives {
  int64_t lines = 0;
  double median_keyframes = 0;
  double mean_keyframes = 0;
  double share_over_10 = 0;  // of the lines: seen in more than ten keyframes
};
LineLives LivesOf(std::vector<int> keyframes);  // of each line; of no lines: zeros
LineLives MeasureLineLives(const std::vector<Line>& lines);

}  // namespace slcmap
