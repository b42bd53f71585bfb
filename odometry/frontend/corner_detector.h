// Where an image has corners that can be located well, spread over it; how strong its noise is, by
// brightness; and where the edges about a corner meet.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace slcmap::inline odometry {

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

// The corners of one image. Its cells, of about cell_px, are searched when they are first needed.
class CornerDetector {
 public:
  // `image` (8 bit) and `mask` must outlive the detector; `noise` is that of the image, and
  // min_response in grey values a pixel across the direction of least texture.
  CornerDetector(const cv::Mat& image, const cv::Mat& mask, double cell_px,
                 const GradientNoise& noise, double min_response);

  // Returns at most max_count integer pixels where `mask` is not 0, at least min_distance_px from
  // each other and from `occupied`. Cells without any point come first, then by response.
  std::vector<Eigen::Vector2d> Find(const std::vector<Eigen::Vector2d>& occupied, int max_count,
                                    double min_distance_px);

 private:
  struct Corner {
    Eigen::Vector2d px;
    float response = 0;
    int cell = 0;
  };

  static bool Stronger(const Corner& a, const Corner& b);
  int CellAt(const Eigen::Vector2d& px) const;
  cv::Rect Area(int cell) const;
  const std::vector<Corner>& FindCorners(int cell);

  cv::Mat image_, mask_;
  std::vector<float> least_by_grey_;  // that a response must have, by the mean around it; rises
  cv::Rect inner_;
  int columns_, rows_;
  std::vector<bool> searched_;
  std::vector<std::vector<Corner>> corners_;  // by cell, the strongest first
};

// The point that lies nearest to the straight lines along all edges about px, weighted by their
// gradients (W. Förstner and E. Gülch, "A fast operator for detection and precise location of
// distinct points, corners and centres of circular features", 1987). Where edges meet, the image
// about that point looks the same however near the camera is; about any other point it does not,
// and as nothing in it tells the scale, alignment takes the change for a shift. Returns px where
// the point is further than a few pixels from it, or px within a few pixels of the border. The
// image has 8 bit and one channel.
Eigen::Vector2d EdgeCrossing(const cv::Mat& image, const Eigen::Vector2d& px);

}  // namespace slcmap::odometry
