// Where an image has corners that can be located well, spread over it.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "odometry/frontend/image_noise.h"

namespace slcmap {

struct CornerDetectorOptions {
  double min_response = 2;  // grey values a pixel across the direction of least texture
  // The square of the same, at least, over the mean square that the image's noise has there: in
  // an image of nothing but noise some place of 10^5 has 2 to 4.
  double min_over_noise = 3.5;
};

// The corners of one image. Its cells, of about cell_px, are searched when they are first needed.
class CornerDetector {
 public:
  // `image` (8 bit) and `mask` must outlive the detector; `noise` is that of the image.
  CornerDetector(const cv::Mat& image, const cv::Mat& mask, double cell_px,
                 const GradientNoise& noise, const CornerDetectorOptions& options);

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
  const std::vector<Corner>& CornersOf(int cell);

  cv::Mat image_, mask_;
  std::vector<float> least_by_grey_;  // that a response must have, by the mean around it; rises
  cv::Rect inner_;
  int columns_, rows_;
  std::vector<bool> searched_;
  std::vector<std::vector<Corner>> corners_;  // by cell, the strongest first
};

}  // namespace slcmap
