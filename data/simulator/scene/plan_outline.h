// Outlines of what is dark in a drawing.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace slcmap::inline data {

// Of a mask that is 255 where it is dark: corners in pixels from its lower left, y up, with what is
// dark to the right of the way; they run between pixels. Specks are left out.
std::vector<std::vector<Eigen::Vector2d>> TraceOutlines(const cv::Mat& mask, double pixel_m);

}  // namespace slcmap::data
