// Poses that were done by somebody else, made to agree with the images.
//
// A tracker, a total station or another SLAM gives poses of its own body at times of its own clock.
// What its calibration against the camera is off, and the clock, lets points of two views be pixels
// from each other. Lines and clouds can be no sharper than that.
#pragma once

#include <optional>
#include <vector>

#include "data/progress.h"
#include "mapping/given_poses/given_pose_figures.h"
#include "mapping/given_poses/pose_adjustment.h"
#include "mapping/given_poses/pose_options.h"
#include "mapping/views/view.h"
#include "odometry/run.h"

namespace slcmap {

struct AdjustedViews {
  Views views;
  PoseCorrection correction;  // of the given ones
  GivenPoseFigures figures;
};

// The views, in their order, with poses that agree with the images, and stay near the given ones.
// Nothing where that is not wanted, where these agree well enough, where too little is seen from
// several views, or that brings no gain. Throws StoppedError when progress says so, and
// ConfigError.
std::optional<AdjustedViews> AdjustGivenViews(const GivenViews& given, const ViewImages& images,
                                              const GivenPoseOptions& options,
                                              const Progress& progress = {});

// States with what all poses share and the clock's offset, by the speeds that their neighbours
// tell.
std::vector<OnlineState> CorrectedStates(const std::vector<OnlineState>& states,
                                         const PoseCorrection& correction);

// AdjustGivenViews for a run, whose keyframes' images these are. Its states are moved by what all
// poses share, and by the clock; refinement.h then moves them with their keyframes. Where progress
// ends it, the run is as it was.
std::optional<GivenPoseFigures> AdjustGivenPoses(const ViewImages& images,
                                                 const GivenPoseOptions& options, OdometryRun* run,
                                                 const Progress& progress = {});

}  // namespace slcmap
