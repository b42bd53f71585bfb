// How strong the noise of an image is, by brightness, as corner detection sees it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace slcmap {

// The variance of the gradient's components (Sobel, in grey values a pixel) that is due to noise.
// It is measured on the gradient itself, in the very image that corners are looked for in:
// resampling (rectification) lowers and correlates noise by how it falls on the pixels.
//
// Of the blocks of the image, sorted into levels of brightness, those with the weakest gradients
// show the noise alone, once their mean gradient, the shading, is removed. Blocks with gradients
// stronger than their finest detail would have as noise have texture, and do not count. Where all
// blocks of a level have texture, its neighbours limit it: the variance of photon and read noise,
// a + b I with a, b >= 0, grows with the signal I, but not faster than it. Where an image is
// enlarged all over, noise is as smooth as texture, and none is found.
class GradientNoise {
 public:
  // Without noise.
  GradientNoise() = default;
  // Of the part of an image (8 bit) where `mask` is not 0.
  GradientNoise(const cv::Mat& image, const cv::Mat& mask);

  // (Grey values a pixel)^2, of one component, where the image has a mean of `grey`; 0 where
  // nothing could be measured.
  double VarianceAt(double grey) const;

 private:
  struct Level {  // of brightness
    double grey = 0, variance = 0;
  };

  std::vector<Level> levels_;  // where they could be measured
};

}  // namespace slcmap
