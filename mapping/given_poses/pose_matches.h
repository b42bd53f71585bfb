// Points that views see in common, found where poses have them.
#pragma once

#include <optional>
#include <vector>

#include "data/progress.h"
#include "mapping/given_poses/pose_options.h"
#include "mapping/views/view.h"
#include "mapping/views/view_matches.h"

namespace slcmap {

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
                                                  const GivenPoseOptions& options,
                                                  const Progress& progress);

// Points of each view (PointsOfViews) looked for in the nearest views that look at about the same,
// before and after it, by pairs of views in order; pairs that have few in common are left out. The
// same on any number of threads. Throws StoppedError when progress says so.
std::vector<PoseMatch> MatchViews(const Views& views,
                                  const std::vector<std::vector<ViewPoint>>& points,
                                  const ViewImages& images, const GivenPoseOptions& options,
                                  const Progress& progress);

}  // namespace slcmap
