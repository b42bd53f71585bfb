// Poses that were done by somebody else, made to agree with the images.
//
// A tracker, a total station or another SLAM gives poses of its own body at times of its own clock.
// What its calibration against the camera is off, and the clock, lets points of two views be pixels
// from each other. Lines and clouds can be no sharper than that.
#pragma once

#include <optional>

#include "data/progress.h"
#include "mapping/given_poses/given_pose_figures.h"
#include "mapping/given_poses/pose_adjustment.h"
#include "mapping/given_poses/pose_options.h"
#include "mapping/views/view.h"
#include "odometry/run.h"

namespace slcmap {

struct AdjustedViews {
  Views views;
  GivenPoseFigures figures;
};

// The views, in their order, with poses that agree with the images, and stay near the given ones.
// Nothing where that is not wanted, where these agree well enough, or too little is seen from
// several views. Throws StoppedError when progress says so, and ConfigError.
std::optional<AdjustedViews> AdjustGivenViews(const GivenViews& given, const ViewImages& images,
                                              const GivenPoseOptions& options,
                                              const Progress& progress = {});

// The same for the keyframes of a run, whose images these are; states are left as they are
// (refinement.h moves them with their keyframes). Where progress ends it, the run is as it was.
std::optional<GivenPoseFigures> AdjustGivenPoses(const ViewImages& images,
                                                 const GivenPoseOptions& options, OdometryRun* run,
                                                 const Progress& progress = {});

}  // namespace slcmap
