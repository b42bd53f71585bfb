// Places a segment on an edge to a fraction of a pixel, by the brightness profiles across it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "data/types.h"

namespace slcmap {

struct LineRefinementOptions {
  double reach_px = 2;         // across the segment, how far its edge may be from where it is given
  double step_px = 3;          // between profiles, along the segment
  double min_support = 0.6;    // share of profiles that agree with the line
  double max_residual_px = 1;  // of a profile that agrees
  double min_gradient = 2;     // grey values a pixel, of the edge
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

}  // namespace slcmap
