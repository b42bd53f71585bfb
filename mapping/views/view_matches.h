// Points of one view found again in another, near where the poses have them.
#pragma once

#include <vector>

#include "mapping/views/view.h"

namespace slcmap {

// A corner of a left image with the depth that its pair gives it.
struct ViewPoint {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double inverse_depth = 0;        // 1/m
  Eigen::Vector2d slope = {0, 0};  // of inverse depth, 1/m a pixel
};

// The corners of a view that stereo knows the depth of; none where an image is missing.
std::vector<ViewPoint> PointsOfView(const StereoImage& pair, const ViewImages& images);

struct ViewMatch {
  size_t point = 0;                                       // index
  Eigen::Vector2d px = Eigen::Vector2d::Zero();           // where it was found in the other view
  Eigen::Vector2d expected_px = Eigen::Vector2d::Zero();  // where poses and depth have it
  Eigen::Vector2d across = Eigen::Vector2d::Zero();       // unit, off the epipolar line
};

struct ViewMatches {
  std::vector<ViewMatch> found;
  int searched = 0;
};

// Looks for points of a view in the left image of another, up to 12 px from where they are
// expected; those that look like other places there are left out.
ViewMatches MatchPoints(const std::vector<ViewPoint>& points, const cv::Mat& from,
                        const cv::Mat& to, const Camera& camera, const RigidTransform& T_to_from);

struct ViewsApart {
  double travel_m = 0, turn_rad = 0;
};
ViewsApart HowFarApart(const View& a, const View& b);

// Views after one, the nearest first, that look at about the same from elsewhere: at most so many.
std::vector<size_t> PartnersOf(const Views& views, size_t first, int later_views, size_t count);

}  // namespace slcmap
