#include "mapping/views/views_between.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr ViewSpacingOptions kSpacing{
    .between_keyframes = true, .min_travel_m = 0.1, .min_turn_rad = 0.1};

View At(int64_t stamp_ns, double x_m, double yaw_rad = 0, int segment = 0) {
  const Eigen::AngleAxisd turn(yaw_rad, Eigen::Vector3d::UnitZ());
  return {stamp_ns, segment, {Eigen::Quaterniond(turn), {x_m, 0, 0}}};
}

// Every 4 cm.
Views Straight(int count) {
  Views frames;
  for (int i = 0; i < count; ++i) frames.push_back(At(i, 0.04 * i));
  return frames;
}

TEST(ViewsBetween, AreApartFromEachOtherAndFromBothKeyframes) {
  const Views frames = Straight(10);
  EXPECT_THAT(SelectViews(frames, {frames[0], frames[9]}, kSpacing), ElementsAre(0, 3, 6, 9));
  // From 3 to 5 it is 8 cm.
  EXPECT_THAT(SelectViews(frames, {frames[0], frames[5]}, kSpacing), ElementsAre(0, 5));
}

TEST(ViewsBetween, ATurnSetsThemApartToo) {
  Views frames;
  for (int i = 0; i < 5; ++i) frames.push_back(At(i, 0, 0.06 * i));
  EXPECT_THAT(SelectViews(frames, {frames[0], frames[4]}, kSpacing), ElementsAre(0, 2, 4));
}

TEST(ViewsBetween, AreNoneWhereTheOptionSaysSo) {
  const Views frames = Straight(10);
  ViewSpacingOptions keyframes_alone = kSpacing;
  keyframes_alone.between_keyframes = false;
  EXPECT_THAT(SelectViews(frames, {frames[0], frames[9]}, keyframes_alone), ElementsAre(0, 9));
}

TEST(ViewsBetween, AreNoneBeforeTheFirstKeyframeAfterTheLastAndBetweenSegments) {
  Views frames = Straight(30);
  for (int i = 15; i < 30; ++i) frames[i].segment = 1;
  EXPECT_THAT(SelectViews(frames, {frames[5], frames[10], frames[20], frames[24]}, kSpacing),
              ElementsAre(5, 10, 20, 24));
  EXPECT_THAT(SelectViews(frames, {}, kSpacing), IsEmpty());
}

TEST(ViewsBetween, KeyframesWithoutAFrameAreLeftOut) {
  const Views frames = Straight(10);
  EXPECT_THAT(SelectViews(frames, {At(-5, -1), frames[0], frames[9]}, kSpacing),
              ElementsAre(0, 3, 6, 9));
}

// Ten times the same way.
Views RoundAndRound() {
  Views frames;
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 20; ++i) frames.push_back(At(20 * round + i, 0.5 * i, 0.01 * round));
  }
  return frames;
}

TEST(ViewsBetween, AreNoMoreFromOnePlaceThanAreEnough) {
  const Views frames = RoundAndRound();
  ViewSpacingOptions options = kSpacing;
  options.max_alike = 3;
  const std::vector<size_t> selected = SelectViews(frames, frames, options);
  ASSERT_EQ(selected.size(), 60u);
  EXPECT_EQ(selected.back(), 59u);  // the first three rounds
  options.max_alike = 10;
  EXPECT_EQ(SelectViews(frames, frames, options).size(), frames.size());
}

TEST(ViewsBetween, AreAllWhereTheyLookOtherWaysOrAreOfOtherSegments) {
  ViewSpacingOptions options = kSpacing;
  options.max_alike = 1;
  Views turned = RoundAndRound(), parted = turned;
  for (size_t i = 0; i < turned.size(); ++i) {
    const double yaw_rad = 0.4 * static_cast<double>(i / 20);
    turned[i] = At(turned[i].stamp_ns, turned[i].T_world_imu.translation.x(), yaw_rad);
    parted[i].segment = static_cast<int>(i / 20);
  }
  EXPECT_EQ(SelectViews(turned, turned, options).size(), turned.size());
  EXPECT_EQ(SelectViews(parted, parted, options).size(), parted.size());
}

// A view's number is the grey value of its image.
class NumberedImages : public ViewImages {
 public:
  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    const cv::Mat image(1, 1, CV_8UC1, cv::Scalar(static_cast<double>(view)));
    return {0, image, image};
  }

 private:
  Rig rig_;
  cv::Mat mask_;
};

TEST(SelectedImages, AreThoseOfTheSelectedViews) {
  const NumberedImages all;
  const SelectedImages selected(all, {4, 7});
  EXPECT_EQ(selected.Read(0).left.at<uchar>(0, 0), 4);
  EXPECT_EQ(selected.Read(1).right.at<uchar>(0, 0), 7);
}

}  // namespace
}  // namespace slcmap
