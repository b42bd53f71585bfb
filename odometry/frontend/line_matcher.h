// Says which segments of two images are the same edge. A wrong match is far worse than none.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "odometry/frontend/line_observation.h"
#include "odometry/options.h"

namespace slcmap {

// Oriented segments of one image with a row of descriptors each.
struct DescribedSegments {
  std::vector<LineSegment> segments;
  cv::Mat descriptors;
};

// Where a known edge is looked for.
struct ExpectedSegment {
  LineSegment segment;  // oriented
  cv::Mat descriptor;   // one row
  double gate_px = 0;   // across the segment, at any place beside the one found
  double slack_px = 0;  // along it, by which the one found may have moved
  double max_angle_rad = 0;
};

// For each expected edge the index of the segment that is its mutual best match, or nothing where
// none passes the gates or a second one is as likely. `free` says which segments may be used.
std::vector<std::optional<int>> MatchExpected(const std::vector<ExpectedSegment>& expected,
                                              const DescribedSegments& found,
                                              const std::vector<char>& free,
                                              const LineMatcherOptions& options);

// For each segment of the left rectified image the index of its mutual best match in the right one,
// judged by the pictures beside both on the same rows.
std::vector<std::optional<int>> MatchStereo(const cv::Mat& left_image, const cv::Mat& right_image,
                                            const std::vector<LineSegment>& left,
                                            const std::vector<LineSegment>& right,
                                            const LineMatcherOptions& options);

}  // namespace slcmap
