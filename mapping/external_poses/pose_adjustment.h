// Poses of views that somebody else gave, moved so that points lie where images have them; and the
// points that views see in common, found where given poses have them.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "data/core/progress.h"
#include "mapping/external_poses/options.h"
#include "mapping/map/map.h"
#include "mapping/views/view.h"
#include "mapping/views/view_matches.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// A point of one view, by its stereo pair, where another view's left image has it.
struct PoseMatch {
  size_t from = 0, to = 0;                           // views
  Eigen::Vector3d p_from = Eigen::Vector3d::Zero();  // m, in the left camera of `from`
  double inverse_depth_sigma = 0;                    // 1/m
  Eigen::Vector2d px = Eigen::Vector2d::Zero();      // in `to`
};

// How far the poses have a point from where it was found (px); nothing behind the camera.
std::optional<Eigen::Vector2d> OffMatch_px(const PoseMatch& match, const Views& views,
                                           const Rig& rig);

// Corners of each view with their depth. The same on any number of threads. Throws StoppedError
// when progress says so.
std::vector<std::vector<ViewPoint>> PointsOfViews(const Views& views, const ViewImages& images,
                                                  const Progress& progress);

// Points of each view (PointsOfViews) looked for in the nearest views that look at about the same,
// before and after it, by pairs of views in order; pairs that have few in common are left out. The
// same on any number of threads. Throws StoppedError when progress says so.
std::vector<PoseMatch> MatchViews(const Views& views,
                                  const std::vector<std::vector<ViewPoint>>& points,
                                  const ViewImages& images, const Progress& progress);

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
                                          const ExternalPoseOptions& options,
                                          const Progress& progress);

// Poses that were done by somebody else, made to agree with the images.
//
// A tracker, a total station or another SLAM gives poses of its own body at times of its own clock.
// What its calibration against the camera is off, and the clock, lets points of two views be pixels
// from each other. Lines and clouds can be no sharper than that.

struct AdjustedViews {
  Views views;
  PoseCorrection correction;  // of the given ones
  ExternalPoseFigures figures;
};

// The views, in their order, with poses that agree with the images, and stay near the given ones.
// Nothing where that is not wanted, where these agree well enough, where too little is seen from
// several views, or that brings no gain. Throws StoppedError when progress says so, and
// ConfigError.
std::optional<AdjustedViews> AdjustGivenViews(const GivenViews& given, const ViewImages& images,
                                              const ExternalPoseOptions& options,
                                              const Progress& progress = {});

// States with what all poses share and the clock's offset, by the speeds that their neighbours
// tell.
std::vector<OnlineState> CorrectedStates(const std::vector<OnlineState>& states,
                                         const PoseCorrection& correction);

// AdjustGivenViews for a run, whose keyframes' images these are. Its states are moved by what all
// poses share, and by the clock; refinement.h then moves them with their keyframes. Where progress
// ends it, the run is as it was.
std::optional<ExternalPoseFigures> AdjustExternalPoses(const ViewImages& images,
                                                       const ExternalPoseOptions& options,
                                                       OdometryRun* run,
                                                       const Progress& progress = {});

}  // namespace slcmap::mapping
