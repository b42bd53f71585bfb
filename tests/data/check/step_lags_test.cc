#include "data/check/step_lags.h"

#include <gtest/gtest.h>

#include <cmath>

namespace slcmap {
namespace {

constexpr double kNoise_rad = 0.002;

// Steps of a rig that is carried: no two seconds are the same.
Eigen::Vector2d StepAt(int frame) {
  return {0.03 * std::sin(0.31 * frame) + 0.01 * std::sin(1.7 * frame),
          0.02 * std::cos(0.23 * frame)};
}

// Of 160 images that are so many frames later than their places.
template <typename Late>
ImageSteps Steps(const Late& late) {
  ImageSteps steps;
  for (int i = 0; i < 159; ++i) {
    Eigen::Vector2d step(0, 0);
    for (int frame = i + late(i); frame < i + 1 + late(i + 1); ++frame) step += StepAt(frame);
    steps.push_back(step);
  }
  return steps;
}

int InStep(int) { return 0; }
int LostTwice(int i) { return (i >= 50) + (i >= 100); }
int LostAndBack(int i) { return i >= 60 && i < 110 ? 1 : 0; }

TEST(FindLags, FindsEverySlipOfEitherCamera) {
  const ImageSteps right = Steps(LostTwice);
  const std::vector<int> lags = FindLags(Steps(InStep), right, kNoise_rad);
  EXPECT_EQ(lags[20], 0);
  EXPECT_EQ(lags[46], 0);
  EXPECT_EQ(lags[54], -1);
  EXPECT_EQ(lags[96], -1);
  EXPECT_EQ(lags[104], -2);
  EXPECT_EQ(FindLags(right, Steps(InStep), kNoise_rad)[120], 2);
  const std::vector<int> and_back = FindLags(Steps(InStep), Steps(LostAndBack), kNoise_rad);
  EXPECT_EQ(and_back[80], -1);
  EXPECT_EQ(and_back[130], 0);
}

TEST(FindLags, TakesNoiseAndRestForNone) {
  ImageSteps left = Steps(InStep), right = left;
  for (size_t i = 0; i < right.size(); ++i) {
    *right[i] *= 1.05;
    right[i]->x() += 0.001 * std::sin(5.1 * static_cast<double>(i));
    if (i % 9 == 0) right[i].reset();  // could not be followed
    if (i > 60 && i < 90) left[i] = right[i] = Eigen::Vector2d(0, 0);
  }
  for (const int lag : FindLags(left, right, kNoise_rad)) EXPECT_EQ(lag, 0);
}

TEST(LateBy, TellsWhichCameraLostAFrame) {
  const auto late = [](int i) { return i >= 80 ? 1 : 0; };
  const ImageSteps gyro = Steps(InStep);
  EXPECT_EQ(LateBy(Steps(late), gyro, 80, 159), 1);
  EXPECT_EQ(LateBy(Steps(late), gyro, 0, 79), 0);
  EXPECT_EQ(LateBy(Steps(late), ImageSteps(159), 80, 159), 0);  // nothing is known
}

}  // namespace
}  // namespace slcmap
