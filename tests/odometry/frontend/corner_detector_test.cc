// Images with the noise of a camera.
#include "odometry/frontend/corner_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace slcmap {
namespace {

// Variance of a signal I in grey values: read + shot I.
struct CameraNoise {
  double read, shot;
  double VarianceAt(double grey) const { return read + shot * grey; }
};

// `signal` (float, grey values) as a camera shows it.
cv::Mat WithNoise(const cv::Mat& signal, const CameraNoise& noise, uint64_t seed = 1) {
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
cv::Mat Resampled(const cv::Mat& image, double step_px, cv::Size size) {
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
cv::Mat Stripes(cv::Size size) {
  cv::Mat signal(size, CV_32F);
  for (int u = 0; u < size.width; ++u) {
    signal.col(u) = 30.f + 50.f * static_cast<float>(4 * u / size.width);
  }
  return signal;
}

using Eigen::Vector2d;

const cv::Size kSize(608, 384);

// As the tracker asks for them.
std::vector<Eigen::Vector2d> Corners(const cv::Mat& image) {
  const PointTrackerOptions tracker;
  const double cell_px = std::sqrt(static_cast<double>(image.total()) / tracker.max_points);
  const cv::Mat mask(image.size(), CV_8U, cv::Scalar(255));
  CornerDetector detector(image, mask, cell_px, GradientNoise(image, mask),
                          tracker.min_corner_gradient);
  return detector.Find({}, tracker.max_points, tracker.min_distance_px);
}

TEST(CornerDetector, FindsNoCornersInNoiseOfAnyLevelAndGain) {
  const cv::Size whole(780, 500);
  for (const CameraNoise& at_gain_1 : {CameraNoise{0.36, 0.023}, {2.3, 0.09}, {4, 0.3}}) {
    for (const double gain : {1.0, 4.0}) {
      const CameraNoise noise{gain * gain * at_gain_1.read, gain * at_gain_1.shot};
      size_t found = 0;
      for (const float grey : {30.f, 90.f, 200.f}) {
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

TEST(CornerDetector, FindsMoreWhereTheyMayBeCloserButNoneInTheMaskOrBesideOthers) {
  const cv::Mat image = WithNoise(SquaresOf(60, 80), CameraNoise{2.3, 0.09});
  cv::Mat mask(kSize, CV_8U, cv::Scalar(255));
  mask.colRange(0, 300) = 0;
  CornerDetector detector(image, mask, 40, GradientNoise(image, mask), 2);
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
  CornerDetector detector(image, mask, 50, GradientNoise(image, mask), 2);
  std::vector<Eigen::Vector2d> left_half;
  for (int v = 10; v < kSize.height; v += 20) {
    for (int u = 10; u < kSize.width / 2; u += 20) left_half.emplace_back(u, v);
  }
  const std::vector<Eigen::Vector2d> found = detector.Find(left_half, 20, 10);
  EXPECT_EQ(found.size(), 20u);
  for (const Eigen::Vector2d& px : found) EXPECT_GT(px.x(), kSize.width / 2 - 30);
}

// Of noise that differs from pixel to pixel: the sum of the squares of Sobel's weights, 12 / 64.
constexpr double kOfGradient = 12.0 / 64;
constexpr double kRounding = 1.0 / 12;  // variance of what 8 bits cut off

GradientNoise Measure(const cv::Mat& image) {
  return GradientNoise(image, cv::Mat(image.size(), CV_8U, cv::Scalar(255)));
}

TEST(GradientNoise, IsThatOfTheCameraAtEachBrightness) {
  for (const CameraNoise& noise : {CameraNoise{1, 0}, {0.4, 0.03}, {2.3, 0.09}, {30, 0.3}}) {
    const GradientNoise measured = Measure(WithNoise(Stripes(kSize), noise));
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
    cv::Mat image = WithNoise(cv::Mat(kSize, CV_32F, cv::Scalar(90)), noise);
    image(cv::Rect(0, 0, kSize.width, 48)).setTo(constant);
    const double expected = kOfGradient * (noise.VarianceAt(90) + kRounding);
    EXPECT_NEAR(Measure(image).VarianceAt(90), expected, 0.2 * expected) << constant;
  }
}

cv::Mat Signal(const std::function<double(int u, int v)>& grey) {
  cv::Mat signal(kSize, CV_32F);
  for (int v = 0; v < signal.rows; ++v) {
    for (int u = 0; u < signal.cols; ++u) signal.at<float>(v, u) = static_cast<float>(grey(u, v));
  }
  return signal;
}

// Half of the image is full of texture, and all is shaded.
TEST(GradientNoise, IsNotMistakenForTextureOrShading) {
  const CameraNoise noise{2.3, 0.09};
  const cv::Mat signal = Signal([](int u, int v) {
    const double texture = 15 * std::sin(0.9 * u) * std::sin(0.8 * v);
    return 40 + 0.2 * u + ((v / 64) % 2 == 0 ? texture : 0);
  });
  const GradientNoise measured = Measure(WithNoise(signal, noise));
  for (const double grey : {60.0, 100.0, 140.0}) {
    const double expected = kOfGradient * (noise.VarianceAt(grey) + kRounding);
    EXPECT_NEAR(measured.VarianceAt(grey), expected, 0.25 * expected) << grey;
  }
}

// What a lens can show is smooth from pixel to pixel, noise is not.
TEST(GradientNoise, IsNotMistakenForTextureThatIsEverywhere) {
  const cv::Mat signal = Signal(
      [](int u, int v) { return 120 + 15 * std::sin(0.6 * u) * std::sin(0.5 * v + 0.1 * u); });
  const CameraNoise noise{1, 0.01};
  EXPECT_LT(Measure(WithNoise(signal, noise)).VarianceAt(120),
            1.5 * kOfGradient * noise.VarianceAt(120));
}

// Where a brightness has texture only, the noise of the others limits what it can be there.
TEST(GradientNoise, GrowsNoFasterThanTheSignal) {
  const CameraNoise noise{1, 0.05};
  const cv::Mat texture = Signal([](int u, int v) {
    return u < 3 * kSize.width / 4 ? 0 : 20 * std::sin(0.9 * u) * std::sin(0.8 * v);
  });
  const cv::Mat signal = Stripes(kSize) + texture;
  const GradientNoise measured = Measure(WithNoise(signal, noise));
  const double at_130 = kOfGradient * (noise.VarianceAt(130) + kRounding);
  EXPECT_LT(measured.VarianceAt(180), 1.15 * 180 / 130 * at_130);
  EXPECT_NEAR(measured.VarianceAt(130), at_130, 0.15 * at_130);
}

TEST(GradientNoise, IsNothingWhereNothingCanBeMeasured) {
  EXPECT_EQ(GradientNoise().VarianceAt(100), 0);
  EXPECT_EQ(Measure(cv::Mat(20, 20, CV_8U, cv::Scalar(100))).VarianceAt(100), 0);
  EXPECT_EQ(Measure(cv::Mat(384, 608, CV_8U, cv::Scalar(255))).VarianceAt(255), 0);
  const cv::Mat image = WithNoise(Stripes(kSize), {4, 0.1});
  EXPECT_EQ(GradientNoise(image, cv::Mat::zeros(image.size(), CV_8U)).VarianceAt(100), 0);
}

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
