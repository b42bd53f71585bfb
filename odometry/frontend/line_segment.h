// Oriented segments in an image (start to end has the bright side on its left): their geometry, and
// their place on an edge to a fraction of a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/types.h"

namespace slcmap::inline odometry {

// The unit vector from start to end.
Eigen::Vector2d Direction(const LineSegment& segment);

// The unit vector across the segment, to the left of its direction as one sees it (y is down).
Eigen::Vector2d Normal(const LineSegment& segment);

LineSegment Reversed(const LineSegment& segment);

// The angle between the directions, 0 to pi: pi for the same segment reversed.
double AngleBetween_rad(const LineSegment& a, const LineSegment& b);

// The signed distance of a point from the infinite line, positive on its left.
double DistanceAcross_px(const LineSegment& line, const Eigen::Vector2d& point_px);

// Where a point lies along the segment, in pixels from its start.
double PlaceAlong_px(const LineSegment& line, const Eigen::Vector2d& point_px);

// How far two nearly parallel segments lie beside each other, along `a`; negative: the gap.
double Overlap_px(const LineSegment& a, const LineSegment& b);

// The largest distance of `b` from the infinite line `a`, over the part of `b` that lies beside `a`
// (over its nearer end where no part does).
double LargestDistance_px(const LineSegment& a, const LineSegment& b);

// The grey value between four pixels; x and y are at least 0, and 1 less than the last ones at
// most.
inline float SampleBetween(const cv::Mat& image, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float u = x - static_cast<float>(column), v = y - static_cast<float>(row);
  const uchar* above = image.ptr(row) + column;
  const uchar* below = image.ptr(row + 1) + column;
  return (1 - v) * ((1 - u) * above[0] + u * above[1]) + v * ((1 - u) * below[0] + u * below[1]);
}

// How far light that fades on one side of an edge moves the place where brightness rises most.

// Brightness across an edge at places from -kEdgeReach to kEdgeReach pixels from it, in grey
// values.
inline constexpr int kEdgeReach = 4;
using EdgeProfile = std::array<double, 2 * kEdgeReach + 1>;

// Where walls meet a ceiling or another wall, brightness does not only step by h: it also has a
// slope on either side, since light fades towards corners. Blurred by sigma, a step with the slopes
// a and b before and behind it rises most not at the edge but (b - a) sigma^2 / h behind it: by the
// same number of pixels at all depths, which turns an edge that recedes. Here that shift, from
// several profiles of one edge, in pixels; nearer to zero the less the profiles agree on it, and 0
// where they don't tell.
double ShadingShift_px(const std::vector<EdgeProfile>& profiles);

struct LineRefinementOptions {
  double reach_px = 2;      // across the segment, how far its edge may be from where it is given
  double min_gradient = 2;  // grey values a pixel, of the edge
  double max_extension_px = 0;  // beyond each end, as far as the edge goes on
};

struct RefinedSegment {
  LineSegment segment;  // oriented: the bright side on the left from start to end
  double gradient = 0;  // mean over the profiles, grey values a pixel
  double rms_px = 0;    // of the profiles' edges about the line
  double support = 0;   // share of profiles that agree
};

// The mean change of brightness from the right to the left side of the segment, grey values.
double MeanContrast(const cv::Mat& image, const LineSegment& segment);

// Moves and turns the segment on to the edge near it, cuts its ends where the edge ends and extends
// them where it goes on. The edge must have the segment's orientation. Nothing where no edge
// follows the segment.
std::optional<RefinedSegment> RefineSegment(const cv::Mat& image, const LineSegment& segment,
                                            const LineRefinementOptions& options);

}  // namespace slcmap::odometry
