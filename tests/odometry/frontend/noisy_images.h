// Images with the noise of a camera.
#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace slcmap {

// Variance of a signal I in grey values: read + shot I.
struct CameraNoise {
  double read, shot;
  double VarianceAt(double grey) const { return read + shot * grey; }
};

// `signal` (float, grey values) as a camera shows it.
inline cv::Mat WithNoise(const cv::Mat& signal, const CameraNoise& noise, uint64_t seed = 1) {
  cv::Mat image(signal.size(), CV_8U);
  cv::RNG rng(seed);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const float grey = signal.at<float>(v, u);
      image.at<uchar>(v, u) =
          cv::saturate_cast<uchar>(grey + rng.gaussian(std::sqrt(noise.VarianceAt(grey))));
    }
  }
  return image;
}

// Resampled bilinearly, `step_px` of the image to a pixel, as rectification does.
inline cv::Mat Resampled(const cv::Mat& image, double step_px, cv::Size size) {
  cv::Mat x(size, CV_32F), y(size, CV_32F), resampled;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      x.at<float>(v, u) = static_cast<float>(2 + step_px * u + 0.013 * v);
      y.at<float>(v, u) = static_cast<float>(2 + 0.997 * step_px * v + 0.007 * u);
    }
  }
  cv::remap(image, resampled, x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return resampled;
}

// Four stripes, each of one brightness.
inline cv::Mat Stripes(cv::Size size) {
  cv::Mat signal(size, CV_32F);
  for (int u = 0; u < size.width; ++u) {
    signal.col(u) = 30.f + 50.f * static_cast<float>(4 * u / size.width);
  }
  return signal;
}

}  // namespace slcmap
