// The pictures beside segments, and how alike they are.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "data/types.h"

namespace slcmap {

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

}  // namespace slcmap
