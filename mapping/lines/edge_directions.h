// Where an image has edges, and which way brightness rises there: quick to ask for many places.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace slcmap {

// CV_16UC1 of the image's size: bit i is set where, within a pixel, there is an edge across which
// brightness rises towards the angle i * 22.5 degrees (x right, y down), give or take 22.5 degrees.
// Edges are the pixels whose gradient is the largest across them and at least min_gradient grey
// values a pixel.
cv::Mat EdgeDirections(const cv::Mat& image, double min_gradient);

// The bit of EdgeDirections for edges across which brightness rises towards `normal`.
uint16_t DirectionBit(const Eigen::Vector2d& normal);

}  // namespace slcmap
