// Points of one view found again in another, near where the poses have them, and how well poses
// agree with what the images show.
#pragma once

#include <Eigen/Core>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/views/view.h"
#include "odometry/frontend/patch.h"

namespace slcmap::inline mapping {

// Where a patch of `from` about a pixel is seen in `to`, within some pixels of a place: `warp` says
// where it is expected, and how offsets in one image look in the other. The places of best
// correlation, aligned to sub-pixels; none where the patch has no texture or reaches beyond an
// image.
std::vector<Eigen::Vector2f> SearchPatch(const cv::Mat& from, const Eigen::Vector2f& from_px,
                                         const cv::Mat& to, const PatchWarp& warp,
                                         double within_px);

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
std::vector<size_t> FindPartners(const Views& views, size_t first, int later_views, size_t count);

// How well the poses of views agree with what their images show.

struct PoseAgreement {
  // What the poses of two views let a point be off across its epipolar line, in pixels: the median
  // over pairs of views of 1.48 times the median over their points. None where too little was
  // found.
  std::optional<double> across_px;
  int pairs = 0;
  // Of the points that were looked for, the share that was found; few where poses are not of the
  // recording. 1 where images show nothing to look for.
  double found = 1;
};

// Looks for corners of the left images that their right ones show, too, at the depth that the pair
// has them, where the poses have them in a later view's left image, up to 12 pixels from there:
// what the right image does not show is noise. Up to 40 pairs of views from all over the recording
// are looked at. Nothing where no view overlaps with a later one, and where progress ended it.
std::optional<PoseAgreement> MeasurePoseAgreement(const Views& views, const ViewImages& images,
                                                  const Progress& progress = {});

// Counts, as a warning of a map, that poses and images do not fit.
inline constexpr const char* kPosesDisagree = "poses_disagree";

// PoseAgreement::across_px, if it can be told. Poses by anyone (`are_given`) may be of another
// recording, frame or unit, and a run's images may have changed since: where they do not agree it
// warns, and counts kPosesDisagree.
std::optional<double> JudgePoses(const Views& views, const ViewImages& images, bool are_given,
                                 const Progress& progress,
                                 std::map<std::string, int64_t>* warnings);

}  // namespace slcmap::mapping
