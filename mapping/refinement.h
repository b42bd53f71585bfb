// Better poses for every image, from the keyframes that were optimised for longer.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "data/trajectory.h"
#include "odometry/run.h"

namespace slcmap {

// The online poses, each corrected as its neighbouring keyframes were corrected after they were
// first estimated. A keyframe's correction is C = T_world_keyframe T_world_online^-1; between the
// two keyframes around a pose (of its own segment) it is interpolated by time, beyond the first and
// last it is that of the nearest. Where the IMU tells the way between two keyframes it replaces
// this (InertialPath): online poses jump as the window changes, at keyframes above all. A segment
// of which no keyframe has the stamp of a state stays as it is, and its poses are counted in
// `warnings`. States are sorted by stamp.
Trajectory RefineTrajectory(const OdometryRun& run, std::map<std::string, int64_t>* warnings);

// The poses of the keyframes, sorted by stamp.
Trajectory KeyframeTrajectory(const std::vector<Keyframe>& keyframes);

}  // namespace slcmap
