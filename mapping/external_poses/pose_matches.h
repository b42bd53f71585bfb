// Points that views see in common, found where given poses have them, and the options of the
// adjustment of such poses.
#pragma once

#include <optional>
#include <vector>

#include "data/core/progress.h"
#include "data/io/yaml.h"
#include "mapping/views/view.h"
#include "mapping/views/view_matches.h"

namespace slcmap::inline mapping {

struct ExternalPoseOptions {
  bool adjust = true;
  // What all poses may be off alike: the body that was tracked against the rig's IMU, and its clock
  // against the images'.
  double sigma_m = 0.005, sigma_rad = 0.005;  // of each pose on top of that
  double point_sigma_px = 0.5;                // of where a point is found in another view
  // Of its depth: loose, as far points of all pairs share errors of a tenth of a pixel, which would
  // bend the way. How far views are apart is told by the poses.
  int max_iterations = 20;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

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
                                  const ViewImages& images, const ExternalPoseOptions& options,
                                  const Progress& progress);

}  // namespace slcmap::mapping
