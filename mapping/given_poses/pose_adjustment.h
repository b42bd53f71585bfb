// Poses of views moved so that points lie where images have them.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "data/progress.h"
#include "mapping/given_poses/pose_matches.h"

namespace slcmap {

// A small move in the frame of a pose: a rotation vector (rad), then a translation (m). Or the
// speed of one, a second.
using PoseMove = std::array<double, 6>;

// Poses as they were given.
struct GivenViews {
  Views views;
  std::vector<PoseMove> speeds;  // of the poses, in their order; zero where it is not known
};

// What given poses are off.
struct PoseCorrection {
  PoseMove common = {};       // of all: the body that was tracked against the rig's IMU
  double clock_s = 0;         // to be added to the images' stamps to have those of the poses
  std::vector<PoseMove> own;  // of each on top of that, in their order
};

// A given pose moved by the sum of what all share, of what passes in clock_s, and of its own.
RigidTransform CorrectedPose(const RigidTransform& given, const PoseCorrection& correction,
                             const PoseMove& speed, const PoseMove& own);
Views Corrected(const GivenViews& given, const PoseCorrection& correction);

// From `start` (with `own` of the size of the views) to where the sum of squares is least: of what
// is corrected, in its standard deviations, and of how far points are from where they were found,
// robustly. A point's depth is that of its own pair, whose error lets it move along the epipolar
// line. Nothing where the solution cannot be used. Throws StoppedError when progress says so.
std::optional<PoseCorrection> AdjustPoses(const GivenViews& given, const PoseCorrection& start,
                                          const std::vector<PoseMatch>& matches, const Rig& rig,
                                          const GivenPoseOptions& options,
                                          const Progress& progress);

}  // namespace slcmap
