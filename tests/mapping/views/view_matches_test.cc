#include "mapping/views/view_matches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/lines/options.h"
#include "mapping/views/views_between.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

using Eigen::Vector2f;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class PoseAgreementTest : public ::testing::Test {
 protected:
  // The pose of each view is moved by what is said of its number.
  template <typename Move>
  Views Moved(Move move) const {
    Views views = room_.views();
    for (size_t i = 0; i < views.size(); ++i) move(i, &views[i].T_world_imu);
    return views;
  }

  static const RoomViews& Room() {
    static const RoomViews room(4, 0.25, 3);
    return room;
  }
  const RoomViews& room_ = Room();
};

TEST_F(PoseAgreementTest, TruePosesAgree) {
  const auto agreement = MeasurePoseAgreement(room_.views(), room_);
  ASSERT_TRUE(agreement);
  EXPECT_GE(agreement->pairs, 5);
  ASSERT_TRUE(agreement->across_px);
  EXPECT_LT(*agreement->across_px, 0.3);
  EXPECT_GT(agreement->found, 0.4);
}

TEST_F(PoseAgreementTest, ATurnIsSeenAsThePixelsThatItMoves) {
  const double angle_rad = 2 / room_.rig().cameras[0].fx_px;
  const auto agreement = MeasurePoseAgreement(
      Moved([&](size_t i, RigidTransform* pose) {
        if (i % 2 == 0)
          pose->rotation = pose->rotation * ExpRotation({0, angle_rad, angle_rad / 2});
      }),
      room_);
  ASSERT_TRUE(agreement);
  ASSERT_TRUE(agreement->across_px);
  EXPECT_GT(*agreement->across_px, 0.6);
  EXPECT_LT(*agreement->across_px, 5);
}

TEST_F(PoseAgreementTest, PosesOfAnotherRecordingFindLittleAndThoseFarApartNothing) {
  const Views& given = room_.views();
  const auto agreement = MeasurePoseAgreement(Moved([&](size_t i, RigidTransform* pose) {
                                                *pose =
                                                    given[(5 * i + 7) % given.size()].T_world_imu;
                                              }),
                                              room_);
  ASSERT_TRUE(agreement);
  EXPECT_LT(agreement->found, 0.2);
  EXPECT_FALSE(MeasurePoseAgreement(Moved([](size_t i, RigidTransform* pose) {
                                      pose->translation.x() += 100.0 * static_cast<double>(i);
                                    }),
                                    room_));
  EXPECT_FALSE(MeasurePoseAgreement({given.front()}, room_)) << "a single view";
}

// The room where its plaster is blank: what is left of its images is noise.
class NoisyRoom : public ViewImages {
 public:
  explicit NoisyRoom(const RoomViews& room) : room_(room) {}

  const Rig& rig() const override { return room_.rig(); }
  const cv::Mat& mask(int camera) const override { return room_.mask(camera); }
  StereoImage Read(size_t view) const override {
    StereoImage pair = room_.Read(view);
    cv::RNG random(view + 1);
    for (cv::Mat* image : {&pair.left, &pair.right}) {
      random.fill(*image, cv::RNG::NORMAL, 128, 6);
    }
    return pair;
  }

 private:
  const RoomViews& room_;
};

TEST_F(PoseAgreementTest, NoiseSaysNothingAgainstPoses) {
  const auto agreement = MeasurePoseAgreement(room_.views(), NoisyRoom(room_));
  ASSERT_TRUE(agreement);
  EXPECT_FALSE(agreement->across_px);
  EXPECT_GT(agreement->found, 0.2);
}

TEST(LineOptionsForPoses, GrowOnlyWhereImagesAndPosesDisagree) {
  const MapLineOptions options;
  EXPECT_EQ(options.ForPoses(0.1).max_spread_px, options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).max_spread_px, 3 * options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).fit.sigma_px, 3 * options.fit.sigma_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(50).max_spread_px, 5 * options.max_spread_px);
}

// Smooth noise, the same at each call.
cv::Mat Texture() {
  cv::Mat noise(200, 300, CV_8UC1), smooth;
  cv::RNG generator(1);
  generator.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, smooth, {0, 0}, 2);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  return smooth;
}

cv::Mat Moved(const cv::Mat& image, const Eigen::Matrix2f& affine, const Vector2f& shift) {
  const cv::Matx23f map(affine(0, 0), affine(0, 1), shift.x(), affine(1, 0), affine(1, 1),
                        shift.y());
  cv::Mat out;
  cv::warpAffine(image, out, map, image.size());
  return out;
}

TEST(PatchSearch, FindsAPlaceBelowThePixel) {
  const cv::Mat from = Texture();
  Eigen::Matrix2f affine;
  affine << 1.1f, -0.05f, 0.05f, 1.1f;
  const Vector2f shift(3.3f, -6.6f), at(150, 100), truth = affine * at + shift;
  const cv::Mat to = Moved(from, affine, shift);
  const PatchWarp expected{truth + Vector2f(7, -5), affine};
  const auto places = SearchPatch(from, at, to, expected, 12);
  ASSERT_FALSE(places.empty());
  EXPECT_LT((places[0] - truth).norm(), 0.1f);
  EXPECT_TRUE(SearchPatch(from, at, to, {truth + Vector2f(30, 0), affine}, 12).empty());
}

TEST(PatchSearch, ARepeatedPatternHasSeveralPlaces) {
  cv::Mat from(200, 300, CV_8UC1, cv::Scalar(40));
  for (int x = 0; x < 300; x += 20) {
    for (int y = 0; y < 200; y += 20) {
      cv::rectangle(from, {x, y, 10, 10}, cv::Scalar(200), cv::FILLED);
    }
  }
  cv::GaussianBlur(from, from, {0, 0}, 1);
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  EXPECT_EQ(SearchPatch(from, {140, 100}, from, {{140, 100}, same}, 25).size(), 3u);
  const cv::Mat texture = Texture(), grey(200, 300, CV_8UC1, cv::Scalar(90));
  EXPECT_TRUE(SearchPatch(grey, {150, 100}, texture, {{150, 100}, same}, 10).empty());
  EXPECT_TRUE(SearchPatch(texture, {2, 100}, texture, {{150, 100}, same}, 10).empty());
  EXPECT_TRUE(SearchPatch(texture, {150, 100}, texture, {{295, 100}, same}, 10).empty());
}

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
  EXPECT_THAT(SelectViews(frames, {At(-5, -1), frames[0], frames[9]}, kSpacing),
              ElementsAre(0, 3, 6, 9))
      << "a keyframe without a frame";
  ViewSpacingOptions keyframes_alone = kSpacing;
  keyframes_alone.between_keyframes = false;
  EXPECT_THAT(SelectViews(frames, {frames[0], frames[9]}, keyframes_alone), ElementsAre(0, 9));
  Views turning;
  for (int i = 0; i < 5; ++i) turning.push_back(At(i, 0, 0.06 * i));
  EXPECT_THAT(SelectViews(turning, {turning[0], turning[4]}, kSpacing), ElementsAre(0, 2, 4));
}

TEST(ViewsBetween, AreNoneBeforeTheFirstKeyframeAfterTheLastAndBetweenSegments) {
  Views frames = Straight(30);
  for (int i = 15; i < 30; ++i) frames[i].segment = 1;
  EXPECT_THAT(SelectViews(frames, {frames[5], frames[10], frames[20], frames[24]}, kSpacing),
              ElementsAre(5, 10, 20, 24));
  EXPECT_THAT(SelectViews(frames, {}, kSpacing), IsEmpty());
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

TEST(PoseJumps, AreWhatMotionIsNot) {
  for (const double rate_hz : {200.0, 20.0, 10.0, 3.0}) {
    EXPECT_TRUE(FindJumps(Walk(rate_hz)).empty()) << rate_hz;
  }
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

TEST(PoseJumps, ATurnOnTheSpotIsOneAStrayPoseTwoAndAGapTellsNothing) {
  const Trajectory walk = Walk(20);
  Trajectory turned = walk, stray = walk, gap = walk;
  const RigidTransform& here = walk[90].T_world_imu;
  MoveFrom(90, here * RigidTransform(ExpRotation({0, 0, 0.4}), {0, 0, 0}) * here.Inverse(),
           &turned);
  const std::vector<PoseJump> jumps = FindJumps(turned);
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_NEAR(jumps[0].turned_rad, 0.4, 0.05);
  stray[40].T_world_imu.translation.x() += 1;
  EXPECT_EQ(FindJumps(stray).size(), 2u);
  // Between poses that are far apart in time anything may have happened.
  gap.erase(gap.begin() + 50, gap.begin() + 80);
  MoveFrom(50, {Eigen::Quaterniond::Identity(), {5, 0, 0}}, &gap);
  EXPECT_TRUE(FindJumps(gap).empty());
}

}  // namespace
}  // namespace slcmap
