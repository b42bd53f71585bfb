// Finds an edge again near where it is expected, without detecting edges.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "data/types.h"

namespace slcmap {

// The segment, at most gate_px across from `expected` (oriented), whose profile (see line_strip.h)
// is the one given: placed to a fraction of a pixel, and as long as the edge goes on. Nothing where
// the correlation is below min_correlation or another place within the gate fits as well.
std::optional<LineSegment> FollowEdge(const cv::Mat& image, const LineSegment& expected,
                                      const Eigen::VectorXf& profile, double gate_px,
                                      double min_correlation);

}  // namespace slcmap
