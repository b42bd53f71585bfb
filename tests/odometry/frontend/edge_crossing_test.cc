#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "odometry/frontend/corner_detector.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// Bright within the angle between two directions at `apex`, averaged over each pixel.
cv::Mat Corner(const Vector2d& apex, double from_rad, double to_rad) {
  constexpr int kSamples = 8;
  cv::Mat image(60, 60, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      int inside = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const Vector2d p(u - 0.5 + (i % kSamples + 0.5) / kSamples,
                         v - 0.5 + (i / kSamples + 0.5) / kSamples);
        const double angle = std::atan2(p.y() - apex.y(), p.x() - apex.x());
        if (angle > from_rad && angle < to_rad) ++inside;
      }
      image.at<uchar>(v, u) = static_cast<uchar>(60 + 120 * inside / (kSamples * kSamples));
    }
  }
  return image;
}

TEST(EdgeCrossing, IsTheApexOfACornerWhereverItIsLookedForFrom) {
  const Vector2d apex(30.3, 29.6);
  for (const double from_rad : {-2.8, -1.0, 0.4}) {
    const cv::Mat image = Corner(apex, from_rad, from_rad + 1.7);
    for (const Vector2d& from : {Vector2d(30, 30), Vector2d(33, 27), Vector2d(28, 32)}) {
      EXPECT_LT((EdgeCrossing(image, from) - apex).norm(), 0.45) << from_rad;
    }
  }
}

TEST(EdgeCrossing, StaysWhereNoneIsNear) {
  const Vector2d px(20, 20);
  EXPECT_EQ(EdgeCrossing(cv::Mat(60, 60, CV_8UC1, cv::Scalar(90)), px), px);
  EXPECT_EQ(EdgeCrossing(Corner({26, 24}, 0.2, 1.5), px), px);
  const Vector2d at_border(2, 30);
  EXPECT_EQ(EdgeCrossing(Corner({3, 30}, 0.2, 1.5), at_border), at_border);
}

}  // namespace
}  // namespace slcmap
