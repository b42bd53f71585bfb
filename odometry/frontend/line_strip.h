// Compares the pictures beside two segments.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "odometry/frontend/line_observation.h"

namespace slcmap {

// The normalised correlation (-1 to 1) of the strips along two segments whose ends correspond; a
// strip's rows run along `across` (unit) at places spread evenly over its segment. It is the best
// of that of the whole strips and those of either side alone, as an edge in front of something far
// keeps one side only. -1 where a strip leaves its image or has no texture.
double StripCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                        const LineSegment& b, const Eigen::Vector2d& across);

// The same of the mean brightness profiles across two segments whose ends don't correspond.
double ProfileCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                          const LineSegment& b);

}  // namespace slcmap
