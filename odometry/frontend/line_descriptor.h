// What an edge looks like, to tell it from others: the line band descriptor (LBD).
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/types.h"

namespace slcmap {

// One row of 32 bytes (LBD, Zhang & Koch 2013) a segment, CV_8UC1; segments are oriented and longer
// than 10 px. Empty without segments.
cv::Mat DescribeSegments(const cv::Mat& image, const std::vector<LineSegment>& segments);

// Bits that differ, of 256.
int DescriptorDistance(const cv::Mat& a, const cv::Mat& b);

}  // namespace slcmap
