// Says which segments of two images are the same edge, by the line band descriptor (LBD) and the
// pictures beside them. A wrong match is far worse than none.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/types.h"
#include "odometry/frontend/options.h"

namespace slcmap::inline odometry {

// One row of 32 bytes (LBD, Zhang & Koch 2013) a segment, CV_8UC1; segments are oriented and longer
// than 10 px. Empty without segments.
cv::Mat DescribeSegments(const cv::Mat& image, const std::vector<LineSegment>& segments);

// Bits that differ, of 256.
int DescriptorDistance(const cv::Mat& a, const cv::Mat& b);

inline constexpr int kProfileReach_px = 10;  // to either side of a segment

// The mean brightness across a segment, a value a pixel, from reach_px on the right of its
// direction to reach_px on its left.
Eigen::VectorXf MeanProfile(const cv::Mat& image, const LineSegment& segment,
                            int reach_px = kProfileReach_px);

// The normalised correlation (-1 to 1) of two profiles of kProfileReach_px: the best of that of the
// whole and of either side alone, as an edge in front of something far keeps one side only.
double ProfileCorrelation(const Eigen::VectorXf& a, const Eigen::VectorXf& b);

// The same of the strips along two segments whose ends correspond; a strip's rows run along
// `across` (unit) at places spread evenly over its segment.
double StripCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                        const LineSegment& b, const Eigen::Vector2d& across);

// Where a known edge is looked for.
struct ExpectedSegment {
  LineSegment segment;      // oriented
  Eigen::VectorXf profile;  // as MeanProfile gives it
  cv::Mat descriptor;       // one row
  double gate_px = 0;       // across the segment, at any place beside the one found
  double slack_px = 0;      // along it, by which the one found may have moved
  double max_angle_rad = 0;
};

// For each expected edge the index of the segment of `image` that is its mutual best match, or
// nothing where none passes the gates or a second one is as likely.
std::vector<std::optional<int>> MatchExpected(const cv::Mat& image,
                                              const std::vector<ExpectedSegment>& expected,
                                              const std::vector<LineSegment>& segments);

// True where the two can be one edge: on the same rows, at a possible disparity, and alike.
bool IsStereoMatch(const cv::Mat& left_image, const cv::Mat& right_image, const LineSegment& left,
                   const LineSegment& right);

// For each segment of the left rectified image the index of its mutual best match in the right one,
// judged by the pictures beside both on the same rows.
std::vector<std::optional<int>> MatchStereo(const cv::Mat& left_image, const cv::Mat& right_image,
                                            const std::vector<LineSegment>& left,
                                            const std::vector<LineSegment>& right);

}  // namespace slcmap::odometry
