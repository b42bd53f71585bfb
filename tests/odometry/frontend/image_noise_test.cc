#include <gtest/gtest.h>

#include <cmath>

#include "odometry/frontend/corner_detector.h"
#include "tests/odometry/frontend/noisy_images.h"

namespace slcmap {
namespace {

const cv::Size kNoiseSize(608, 384);
// Of noise that differs from pixel to pixel: the sum of the squares of Sobel's weights, 12 / 64.
constexpr double kOfGradient = 12.0 / 64;
constexpr double kRounding = 1.0 / 12;  // variance of what 8 bits cut off

GradientNoise Measure(const cv::Mat& image) {
  return GradientNoise(image, cv::Mat(image.size(), CV_8U, cv::Scalar(255)));
}

TEST(GradientNoise, IsThatOfTheCameraAtEachBrightness) {
  for (const CameraNoise& noise : {CameraNoise{1, 0}, {0.4, 0.03}, {2.3, 0.09}, {30, 0.3}}) {
    const GradientNoise measured = Measure(WithNoise(Stripes(kNoiseSize), noise));
    for (const double grey : {30.0, 80.0, 130.0, 180.0}) {
      const double expected = kOfGradient * (noise.VarianceAt(grey) + kRounding);
      EXPECT_NEAR(measured.VarianceAt(grey), expected, 0.15 * expected) << grey;
    }
  }
}

// Bars above and below the picture, or the level of black of a video camera.
TEST(GradientNoise, IsMeasuredBesideWhatIsConstant) {
  const CameraNoise noise{2.3, 0.09};
  for (const int constant : {16, 90, 238}) {
    cv::Mat image = WithNoise(cv::Mat(kNoiseSize, CV_32F, cv::Scalar(90)), noise);
    image(cv::Rect(0, 0, kNoiseSize.width, 48)).setTo(constant);
    const double expected = kOfGradient * (noise.VarianceAt(90) + kRounding);
    EXPECT_NEAR(Measure(image).VarianceAt(90), expected, 0.2 * expected) << constant;
  }
}

// Half of the image is full of texture, and all is shaded.
TEST(GradientNoise, IsNotMistakenForTextureOrShading) {
  const CameraNoise noise{2.3, 0.09};
  cv::Mat signal(kNoiseSize, CV_32F);
  for (int v = 0; v < kNoiseSize.height; ++v) {
    for (int u = 0; u < kNoiseSize.width; ++u) {
      const bool textured = (v / 64) % 2 == 0;
      const double texture = textured ? 15 * std::sin(0.9 * u) * std::sin(0.8 * v) : 0;
      signal.at<float>(v, u) = static_cast<float>(40 + 0.2 * u + texture);
    }
  }
  const GradientNoise measured = Measure(WithNoise(signal, noise));
  for (const double grey : {60.0, 100.0, 140.0}) {
    const double expected = kOfGradient * (noise.VarianceAt(grey) + kRounding);
    EXPECT_NEAR(measured.VarianceAt(grey), expected, 0.25 * expected) << grey;
  }
}

// What a lens can show is smooth from pixel to pixel, noise is not.
TEST(GradientNoise, IsNotMistakenForTextureThatIsEverywhere) {
  cv::Mat signal(kNoiseSize, CV_32F);
  for (int v = 0; v < kNoiseSize.height; ++v) {
    for (int u = 0; u < kNoiseSize.width; ++u) {
      signal.at<float>(v, u) =
          static_cast<float>(120 + 15 * std::sin(0.6 * u) * std::sin(0.5 * v + 0.1 * u));
    }
  }
  const CameraNoise noise{1, 0.01};
  EXPECT_LT(Measure(WithNoise(signal, noise)).VarianceAt(120),
            1.5 * kOfGradient * noise.VarianceAt(120));
}

// Where a brightness has texture only, the noise of the others limits what it can be there.
TEST(GradientNoise, GrowsNoFasterThanTheSignal) {
  const CameraNoise noise{1, 0.05};
  cv::Mat signal = Stripes(kNoiseSize);
  for (int v = 0; v < kNoiseSize.height; ++v) {
    for (int u = 3 * kNoiseSize.width / 4; u < kNoiseSize.width; ++u) {
      signal.at<float>(v, u) += static_cast<float>(20 * std::sin(0.9 * u) * std::sin(0.8 * v));
    }
  }
  const GradientNoise measured = Measure(WithNoise(signal, noise));
  const double at_130 = kOfGradient * (noise.VarianceAt(130) + kRounding);
  EXPECT_LT(measured.VarianceAt(180), 1.15 * 180 / 130 * at_130);
  EXPECT_NEAR(measured.VarianceAt(130), at_130, 0.15 * at_130);
}

TEST(GradientNoise, IsLessInAResampledImage) {
  const CameraNoise noise{4, 0.1};
  const cv::Mat image = WithNoise(Stripes(kNoiseSize * 2), noise);
  const cv::Mat resampled = Resampled(image, 1.25, kNoiseSize);
  const double grey = resampled.at<uchar>(100, 20);
  EXPECT_LT(Measure(resampled).VarianceAt(grey), 0.7 * Measure(image).VarianceAt(grey));
  EXPECT_GT(Measure(resampled).VarianceAt(grey), 0.4 * Measure(image).VarianceAt(grey));
}

TEST(GradientNoise, IsNothingWhereNothingCanBeMeasured) {
  EXPECT_EQ(GradientNoise().VarianceAt(100), 0);
  EXPECT_EQ(Measure(cv::Mat(20, 20, CV_8U, cv::Scalar(100))).VarianceAt(100), 0);
  EXPECT_EQ(Measure(cv::Mat(384, 608, CV_8U, cv::Scalar(255))).VarianceAt(255), 0);
  const cv::Mat image = WithNoise(Stripes(kNoiseSize), {4, 0.1});
  EXPECT_EQ(GradientNoise(image, cv::Mat::zeros(image.size(), CV_8U)).VarianceAt(100), 0);
}

}  // namespace
}  // namespace slcmap
