// Finds the straight edges of a grey image, and an edge again near where it is expected.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/types.h"
#include "odometry/frontend/options.h"

namespace slcmap::inline odometry {

// The straight edges of an 8 bit image: oriented (the bright side on the left from start to end),
// broken pieces joined, to a fraction of a pixel, longest first. Edges that leave the mask (255:
// valid; of the image's size, or empty) or run along its border are left out.
std::vector<LineSegment> DetectSegments(const cv::Mat& image, const cv::Mat& mask,
                                        const LineDetectorOptions& options);

// What the detector alone gives in the image made smaller: neither oriented, joined nor refined.
std::vector<LineSegment> DetectRawSegments(const cv::Mat& image, const LineDetectorOptions& options,
                                           double min_length_px);

// Joins oriented segments of one edge: those that continue each other over a gap of at most
// max_gap_px and those that lie upon each other.
std::vector<LineSegment> JoinSegments(std::vector<LineSegment> segments, double max_gap_px);

// The segment, at most gate_px across from `expected` (oriented), whose profile (see
// odometry/frontend/line_matcher.h) is the one given: placed to a fraction of a pixel, and as long
// as the edge goes on. Nothing where the correlation is below min_correlation or another place
// within the gate fits as well.
std::optional<LineSegment> FollowEdge(const cv::Mat& image, const LineSegment& expected,
                                      const Eigen::VectorXf& profile, double gate_px,
                                      double min_correlation);

}  // namespace slcmap::odometry
