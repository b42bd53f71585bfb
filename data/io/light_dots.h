// The dots that a depth camera's emitter throws on what is before it: they move with the camera, so
// they are no part of the scene.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "data/io/image.h"

namespace slcmap::inline data {

// All take grey images of 8 bits.

// The image with what is bright and smaller than a few pixels taken out.
cv::Mat WithoutDots(const cv::Mat& image);

// How high small bright spots stand over what is around them in the mean, as a share of the image's
// mean.
double DotLevel(const cv::Mat& image);

// Whether images of one camera, taken at places apart, show the same dots: each part of one looks
// like a part of the next in the same rows, near by, as dots do whatever they fall on. Not where
// the images look alike as a whole, as those of a camera at rest do.
bool ShowSameDots(const std::vector<cv::Mat>& images);

// Which of a camera's images, by index, show the dots of an emitter that lights every other one;
// none where it is not every other one. Lost images may be between them.
std::vector<size_t> FindLitImages(const ImageStore& images, const std::vector<std::string>& paths);

}  // namespace slcmap::data
