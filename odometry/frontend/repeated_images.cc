#include "odometry/frontend/repeated_images.h"

#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>

namespace slcmap {
namespace {

bool IsUniform(const cv::Mat& image) {
  double low = 0, high = 0;
  cv::minMaxLoc(image, &low, &high);
  return low == high;
}

// Stops at the first row that differs: with sensor noise, that is the first.
bool Equal(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || a.size() != b.size() || a.type() != b.type()) return false;
  const size_t row_bytes = static_cast<size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), row_bytes) != 0) return false;
  }
  return !IsUniform(a);
}

}  // namespace

bool RepeatedImages::Repeats(const cv::Mat& image) {
  const bool repeats = Equal(image, last_);
  image.copyTo(last_);
  return repeats;
}

}  // namespace slcmap
