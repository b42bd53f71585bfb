// Says which segments of two images are the same edge. A wrong match is far worse than none.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/types.h"
#include "odometry/frontend/options.h"

namespace slcmap {

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
                                              const std::vector<LineSegment>& segments,
                                              const LineMatcherOptions& options);

// True where the two can be one edge: on the same rows, at a possible disparity, and alike.
bool IsStereoMatch(const cv::Mat& left_image, const cv::Mat& right_image, const LineSegment& left,
                   const LineSegment& right, const LineMatcherOptions& options);

// For each segment of the left rectified image the index of its mutual best match in the right one,
// judged by the pictures beside both on the same rows.
std::vector<std::optional<int>> MatchStereo(const cv::Mat& left_image, const cv::Mat& right_image,
                                            const std::vector<LineSegment>& left,
                                            const std::vector<LineSegment>& right,
                                            const LineMatcherOptions& options);

}  // namespace slcmap
