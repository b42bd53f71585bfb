#include "odometry/frontend/corner_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "odometry/options.h"
#include "tests/odometry/frontend/noisy_images.h"

namespace slcmap {
namespace {

const cv::Size kSize(608, 384);

// As the tracker asks for them.
std::vector<Eigen::Vector2d> Corners(const cv::Mat& image) {
  const PointTrackerOptions tracker;
  CornerDetectorOptions options;
  options.min_response = tracker.min_corner_gradient;
  const double cell_px = std::sqrt(static_cast<double>(image.total()) / tracker.max_points);
  const cv::Mat mask(image.size(), CV_8U, cv::Scalar(255));
  CornerDetector detector(image, mask, cell_px, GradientNoise(image, mask), options);
  return detector.Find({}, tracker.max_points, tracker.min_distance_px);
}

TEST(CornerDetector, FindsNoCornersInNoiseOfAnyLevelAndGain) {
  const cv::Size whole(780, 500);
  for (const CameraNoise& at_gain_1 : {CameraNoise{0.36, 0.023}, {2.3, 0.09}, {4, 0.3}}) {
    for (const double gain : {1.0, 4.0}) {
      const CameraNoise noise{gain * gain * at_gain_1.read, gain * at_gain_1.shot};
      size_t found = 0;
      for (const float grey : {30, 90, 200}) {
        const cv::Mat image = WithNoise(cv::Mat(whole, CV_32F, cv::Scalar(grey)), noise);
        for (const double step_px : {1.4, 1.25, 1.0}) {
          found += Corners(Resampled(image, step_px, kSize)).size();
        }
      }
      EXPECT_LE(found, 4u) << "of 1440; read " << noise.read << ", shot " << noise.shot;
    }
  }
}

// Squares that stand out of their ground by a contrast in grey values.
cv::Mat SquaresOf(double grey, double contrast) {
  cv::Mat signal(kSize, CV_32F, cv::Scalar(grey));
  for (int v = 40; v + 40 < kSize.height; v += 60) {
    for (int u = 40; u + 40 < kSize.width; u += 60) {
      signal(cv::Rect(u, v, 30, 30)) += cv::Scalar(contrast);
    }
  }
  cv::GaussianBlur(signal, signal, {}, 0.6);
  return signal;
}

TEST(CornerDetector, KeepsCornersOfLowContrastThatStandOutOfTheNoise) {
  for (const CameraNoise& noise : {CameraNoise{0.36, 0.023}, {2.3, 0.09}, {16, 0.5}}) {
    const double contrast = 10 * std::sqrt(noise.VarianceAt(60));
    const std::vector<Eigen::Vector2d> corners = Corners(WithNoise(SquaresOf(60, contrast), noise));
    size_t at_squares = 0;
    for (const Eigen::Vector2d& px : corners) {
      const double x = std::fmod(px.x() - 40 + 600, 60), y = std::fmod(px.y() - 40 + 600, 60);
      const auto near = [](double at) { return std::min({at, std::abs(at - 30), 60 - at}) < 5; };
      if (near(x) && near(y)) ++at_squares;
    }
    EXPECT_GT(at_squares, 120u) << contrast << " grey values";  // of 160 at most
    EXPECT_LE(corners.size() - at_squares, 4u) << contrast << " grey values";
  }
}

TEST(CornerDetector, FindsTheMaximaOfTheSmallerEigenvalue) {
  const cv::Mat image = WithNoise(SquaresOf(60, 80), CameraNoise{2.3, 0.09});
  cv::Mat response, highest;
  cv::cornerMinEigenVal(image, response, 7, 3);
  cv::dilate(response, highest, cv::Mat());
  const std::vector<Eigen::Vector2d> corners = Corners(image);
  EXPECT_GT(corners.size(), 150u);
  for (const Eigen::Vector2d& px : corners) {
    const cv::Point at(static_cast<int>(px.x()), static_cast<int>(px.y()));
    EXPECT_GE(response.at<float>(at), 0.9999f * highest.at<float>(at)) << px.transpose();
  }
}

TEST(CornerDetector, FindsMoreWhereTheyMayBeCloserButNoneInTheMaskOrBesideOthers) {
  const cv::Mat image = WithNoise(SquaresOf(60, 80), CameraNoise{2.3, 0.09});
  cv::Mat mask(kSize, CV_8U, cv::Scalar(255));
  mask.colRange(0, 300) = 0;
  CornerDetector detector(image, mask, 40, GradientNoise(image, mask), CornerDetectorOptions());
  std::vector<Eigen::Vector2d> found = detector.Find({}, 200, 40);
  const size_t apart = found.size();
  EXPECT_GT(apart, 20u);
  for (const Eigen::Vector2d& px : detector.Find(found, 200, 20)) found.push_back(px);
  EXPECT_GT(found.size(), apart + 20);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_GE(found[i].x(), 300);
    for (size_t k = 0; k < i; ++k) EXPECT_GE((found[i] - found[k]).norm(), i < apart ? 40 : 20);
  }
}

TEST(CornerDetector, LooksFirstWhereThereIsNoPoint) {
  const cv::Mat image = WithNoise(SquaresOf(60, 80), CameraNoise{2.3, 0.09});
  const cv::Mat mask(kSize, CV_8U, cv::Scalar(255));
  CornerDetector detector(image, mask, 50, GradientNoise(image, mask), CornerDetectorOptions());
  std::vector<Eigen::Vector2d> left_half;
  for (int v = 10; v < kSize.height; v += 20) {
    for (int u = 10; u < kSize.width / 2; u += 20) left_half.emplace_back(u, v);
  }
  const std::vector<Eigen::Vector2d> found = detector.Find(left_half, 20, 10);
  EXPECT_EQ(found.size(), 20u);
  for (const Eigen::Vector2d& px : found) EXPECT_GT(px.x(), kSize.width / 2 - 30);
}

}  // namespace
}  // namespace slcmap
