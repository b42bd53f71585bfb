#include "mapping/views/views_between.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

// Ten seconds of a walk in a circle that speeds up, and turns quickly to and fro.
Trajectory Walk(double rate_hz) {
  Trajectory trajectory;
  for (int i = 0; i <= 10 * rate_hz; ++i) {
    const double t_s = i / rate_hz, angle = 0.03 * t_s * t_s;
    const Eigen::Vector3d p(3 * std::cos(angle), 3 * std::sin(angle), 0.05 * std::sin(10 * t_s));
    const Eigen::Vector3d turn(0.1 * std::sin(12 * t_s), 0, angle + 0.3 * std::sin(4 * t_s));
    trajectory.push_back({ToNanoseconds(t_s), {ExpRotation(turn), p}});
  }
  return trajectory;
}

void MoveFrom(size_t first, const RigidTransform& T, Trajectory* trajectory) {
  for (size_t i = first; i < trajectory->size(); ++i) {
    (*trajectory)[i].T_world_imu = T * (*trajectory)[i].T_world_imu;
  }
}

TEST(PoseJumps, MotionIsNone) {
  for (const double rate_hz : {200.0, 20.0, 10.0, 3.0}) {
    EXPECT_TRUE(FindJumps(Walk(rate_hz)).empty()) << rate_hz;
  }
}

TEST(PoseJumps, ASideStepIsOne) {
  for (const double rate_hz : {200.0, 20.0}) {
    Trajectory trajectory = Walk(rate_hz);
    const size_t at = trajectory.size() / 2;
    MoveFrom(at, {Eigen::Quaterniond::Identity(), {0, 0, 0.3}}, &trajectory);
    const std::vector<PoseJump> jumps = FindJumps(trajectory);
    ASSERT_EQ(jumps.size(), 1u) << rate_hz;
    EXPECT_EQ(jumps[0].stamp_ns, trajectory[at].stamp_ns);
    EXPECT_NEAR(jumps[0].moved_m, 0.3, 0.03);
  }
}

TEST(PoseJumps, ATurnOnTheSpotIsOne) {
  Trajectory trajectory = Walk(20);
  const RigidTransform& here = trajectory[90].T_world_imu;
  const RigidTransform turn{ExpRotation({0, 0, 0.4}), Eigen::Vector3d::Zero()};
  MoveFrom(90, here * turn * here.Inverse(), &trajectory);
  const std::vector<PoseJump> jumps = FindJumps(trajectory);
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_NEAR(jumps[0].turned_rad, 0.4, 0.05);
}

TEST(PoseJumps, AStrayPoseIsTwo) {
  Trajectory trajectory = Walk(20);
  trajectory[40].T_world_imu.translation.x() += 1;
  EXPECT_EQ(FindJumps(trajectory).size(), 2u);
}

// Between poses that are far apart in time anything may have happened.
TEST(PoseJumps, GapsTellNothing) {
  Trajectory trajectory = Walk(20);
  trajectory.erase(trajectory.begin() + 50, trajectory.begin() + 80);
  MoveFrom(50, {Eigen::Quaterniond::Identity(), {5, 0, 0}}, &trajectory);
  EXPECT_TRUE(FindJumps(trajectory).empty());
}

}  // namespace
}  // namespace slcmap
