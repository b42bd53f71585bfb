#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/calibration/mask.h"
#include "data/check/step_lags.h"
#include "tests/testing/memory_source.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

constexpr int kWidth_px = 320, kHeight_px = 240, kCount = 160;
constexpr double kFocal_px = 200;

cv::Mat Texture(int width_px, int seed) {
  cv::RNG random(seed);
  cv::Mat texture(2 * kHeight_px, width_px, CV_8UC1);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {}, 2);
  cv::normalize(texture, texture, 20, 235, cv::NORM_MINMAX);
  return texture;
}

struct Walk {
  double swing_rad = 0.6;   // to both sides, about the vertical
  double bias_rad_s = 0;    // of the gyroscope
  int carried_rows_px = 0;  // at the lower border, of what moves with the rig
  double orbit_px = 0;      // that the building moves on in an image, instead of by the swing
};

// One camera that looks along z, and an IMU with the same axes. What it sees is far away.
testing::MemorySource Recording(const Walk& walk) {
  const cv::Mat world = Texture(4000, 1), body = Texture(kWidth_px, 2);
  Rig rig;
  rig.cameras[0] = testing::PinholeCamera(kWidth_px, kHeight_px, kFocal_px, 159.5, 119.5);
  std::vector<StereoImage> images;
  std::vector<ImuSample> samples;
  cv::RNG noise(3);
  const auto angle_rad = [&](double t_s) { return walk.swing_rad * std::sin(1.3 * t_s); };
  for (int i = 0; i < kCount; ++i) {
    const double t_s = 0.05 * i;
    const double shift_px = walk.orbit_px > 0 ? walk.orbit_px * i : kFocal_px * angle_rad(t_s);
    cv::Mat image =
        world(cv::Rect(2000 + static_cast<int>(std::lround(shift_px)), 0, kWidth_px, kHeight_px))
            .clone();
    if (walk.carried_rows_px > 0) {
      body(cv::Rect(0, 0, kWidth_px, walk.carried_rows_px))
          .copyTo(image.rowRange(kHeight_px - walk.carried_rows_px, kHeight_px));
    }
    cv::Mat grain(image.size(), CV_16SC1);
    noise.fill(grain, cv::RNG::NORMAL, 0, 2);
    cv::add(image, grain, image, cv::noArray(), CV_8U);
    images.push_back({ToNanoseconds(t_s), image, {}});
  }
  for (int i = 0; i < 10 * kCount; ++i) {
    const double t_s = 0.005 * i;
    const double rate_rad_s = (angle_rad(t_s + 1e-4) - angle_rad(t_s - 1e-4)) / 2e-4;
    samples.push_back({ToNanoseconds(t_s), {0, rate_rad_s + walk.bias_rad_s, 0}, {0, -9.81, 0}});
  }
  return {rig, images, samples};
}

cv::Mat MaskOf(const Walk& walk) {
  testing::MemorySource source = Recording(walk);
  return FindCarried(source, AllSamples(&source), {})[0];
}

TEST(Carried, WhatMovesWithTheRigIsFound) {
  for (const int rows_px : {40, 84, 144}) {
    const cv::Mat mask = MaskOf({.carried_rows_px = rows_px});
    ASSERT_FALSE(mask.empty()) << rows_px;
    EXPECT_EQ(cv::countNonZero(mask.rowRange(kHeight_px - rows_px, kHeight_px)), 0) << rows_px;
    EXPECT_GT(cv::countNonZero(mask), kWidth_px * (kHeight_px - rows_px - 28)) << rows_px;
  }
}

TEST(Carried, ABuildingIsNot) { EXPECT_TRUE(MaskOf({}).empty()); }

TEST(Carried, ARigAtRestIsNotWhateverItsGyroscopeSays) {
  EXPECT_TRUE(MaskOf({.swing_rad = 0, .bias_rad_s = 0.09}).empty());
  EXPECT_TRUE(MaskOf({.swing_rad = 0.01, .bias_rad_s = 0.05}).empty());
}

// The rig turns, and by its movement what it looks at stays nearly where it is for a while.
TEST(Carried, WhatTheRigCirclesIsNot) { EXPECT_TRUE(MaskOf({.orbit_px = 0.2}).empty()); }

}  // namespace
}  // namespace slcmap
