// Finds the straight edges of a grey image.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/types.h"
#include "odometry/frontend/options.h"

namespace slcmap {

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

}  // namespace slcmap
