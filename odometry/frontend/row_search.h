// The place of a piece of the left image along the same row of the right one.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace slcmap {

struct RowMatch {
  Eigen::Vector2f right_px;
  float correlation = 0;  // normalised
};

// Compares the square around left_px, rounded to a pixel, with every disparity from -1 to
// max_disparity_px. Nothing where the square reaches beyond the image or has no texture.
std::optional<RowMatch> SearchRow(const cv::Mat& left, const cv::Mat& right,
                                  const Eigen::Vector2f& left_px, int max_disparity_px);

}  // namespace slcmap
