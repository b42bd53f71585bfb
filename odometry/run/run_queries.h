// What is reported of a run's lines and points, the rig with what the run has found of its
// calibration, and a run without values that are not finite or beyond limits.
#pragma once

#include <cstdint>
#include <vector>

#include "data/io/map_line.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

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
struct LineTrackLengths {
  int64_t lines = 0;
  double median_keyframes = 0;
  double mean_keyframes = 0;
  double share_over_10 = 0;  // of the lines: seen in more than ten keyframes
};
LineTrackLengths ComputeTrackLengths(
    std::vector<int> keyframes);  // of each line; of no lines: zeros
LineTrackLengths MeasureLineTracks(const std::vector<Line>& lines);

// How many points keyframes saw, and how many of them a single one: where that is most of them,
// there was little to see but noise, or they were lost from keyframe to keyframe.
struct PointTrackLengths {
  int64_t points = 0;
  int64_t seen_once = 0;
};
PointTrackLengths MeasurePointTracks(const std::vector<Keyframe>& keyframes);

// Keeps values that are not finite, or beyond what run_rows.h allows, out of what odometry hands
// on.

bool IsFinite(const OdometryRun& run);

// Leaves out states, keyframes, their observations, landmarks, lines and Manhattan worlds that hold
// a value that is not finite or absurdly large (with a world, the lines along its axes), and counts
// them in warnings.
OdometryRun WithoutNonFinite(OdometryRun run);

// `given` as the run was given it, raw, with its rectified form; the estimate's corrections are
// those of odometry/factors/blocks.h.
Rig CalibratedRig(const Rig& given, const Rig& rectified, const CalibrationEstimate& estimate);

}  // namespace slcmap::odometry
