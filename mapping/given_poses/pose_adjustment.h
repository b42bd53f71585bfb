// Poses of views moved so that points lie where images have them.
#pragma once

#include <vector>

#include "data/progress.h"
#include "mapping/given_poses/pose_matches.h"

namespace slcmap {

// The views with their poses where the sum of squares is least of how far they are from the given
// ones, in standard deviations, and of how far points are from where they were found, robustly. A
// point's depth is that of its own pair, whose error lets it move along the epipolar line. `start`
// are the given views in their order, perhaps adjusted before. Throws StoppedError when progress
// says so.
Views AdjustViews(const Views& given, const Views& start, const std::vector<PoseMatch>& matches,
                  const Rig& rig, const GivenPoseOptions& options, const Progress& progress);

}  // namespace slcmap
