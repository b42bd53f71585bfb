// Where an image has corners that can be located well, spread over it.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "odometry/frontend/image_noise.h"

namespace slcmap {

struct CornerDetectorOptions {
  double min_distance_px = 20;
  double min_response = 2;  // grey values a pixel across the direction of least texture
  // The square of the same, at least, over the mean square that the image's noise has there: in
  // an image of nothing but noise some place of 10^5 has 2 to 4.
  double min_over_noise = 3.5;
  int border_px = 8;
};

// Returns at most max_count integer pixels where `mask` is not 0, at least min_distance_px from
// each other and from `occupied`; `noise` is that of the image. Cells of the image without any
// point come first, then by response.
std::vector<Eigen::Vector2d> DetectCorners(const cv::Mat& image, const cv::Mat& mask,
                                           const std::vector<Eigen::Vector2d>& occupied,
                                           int max_count, double cell_px,
                                           const GradientNoise& noise,
                                           const CornerDetectorOptions& options);

}  // namespace slcmap
