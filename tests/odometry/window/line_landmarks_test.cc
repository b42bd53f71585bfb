#include "odometry/window/line_landmarks.h"

#include <gtest/gtest.h>

#include "tests/odometry/window/line_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kFrames = 6;

class LineLandmarksTest : public testing::LineScene {
 protected:
  void SetUp() override {
    MakeLine(options_.sigma_px, &window_.headings.emplace_back(), &window_.lines[kLine]);
    for (int i = 0; i < kFrames; ++i) AddFrame(i, &line());
  }

  // Frame i sees the line with one end down and the other up by so many pixels.
  void See(int i, double off_px) {
    const Vector2d off(0, off_px / kFocal_px);
    StereoLineMeasurement seen = ObservationOf(i);
    seen.left = {seen.left.start + off, seen.left.end - off};
    seen.right = LineSegment{seen.right->start + off, seen.right->end - off};
    window_.frames[i]->lines[kLine] = seen;
  }

  LineLandmark& line() { return window_.lines.at(kLine); }

  const LineLandmarkOptions options_;
};

TEST_F(LineLandmarksTest, KeepsALineThatFits) {
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(line().frames.size(), kFrames);
}

TEST_F(LineLandmarksTest, RejectsAnObservationOfAnotherEdgeBeforeItMovesTheFrame) {
  See(kFrames - 1, 20);
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_FALSE(window_.frames.back()->lines.contains(kLine));
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

TEST_F(LineLandmarksTest, AnObservationThatWasRejectedIsNotTheLastReported) {
  EXPECT_EQ(Describe(line(), model_, {}).last_keyframe, kFrames - 1);
  See(kFrames - 1, 6 * options_.sigma_px);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(Describe(line(), model_, {}).last_keyframe, kFrames - 2);
}

// It was seen only by frames that have left the window, until the wrong match.
TEST_F(LineLandmarksTest, SurvivesTheLossOfItsOnlyObservation) {
  line().last_released_frame = 0;
  for (int i = 0; i < kFrames - 1; ++i) window_.frames[i]->lines.clear();
  line().frames = {window_.frames.back().get()};
  line().extent.Add(-1, 1);
  See(kFrames - 1, 20);
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_TRUE(line().frames.empty());
  EXPECT_EQ(line().last_seen_frame(), 0);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  ExtendLines(*window_.frames.back(), model_, &window_);
  EXPECT_TRUE(MergeLines(options_, &window_).empty());
  EXPECT_EQ(PredictLines(window_, *window_.frames.back(), rig_).size(), 1u);
}

TEST_F(LineLandmarksTest, RejectsTheRightObservationAloneWhereItAloneIsOfAnotherEdge) {
  auto& observation = window_.frames.back()->lines.at(kLine);
  observation.right->start.y() += 20 / kFocal_px;
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_FALSE(observation.right);
  EXPECT_EQ(line().frames.size(), kFrames);
}

TEST_F(LineLandmarksTest, OneOutlierGoesAndTheLineStays) {
  See(2, 6 * options_.sigma_px);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

// Nearly along the axis, as the grain of wood is: no observation is far off, but all are.
TEST_F(LineLandmarksTest, RetiresALineWhoseObservationsAllMisfitALittle) {
  for (int i = 0; i < kFrames; ++i) See(i, 1.5 * options_.sigma_px);
  EXPECT_EQ(RejectLineOutliers(options_, model_, &window_).count(kLine), 1u);
  EXPECT_TRUE(line().retired);
}

TEST_F(LineLandmarksTest, TheVerticalIsAnAxisBeforeAnyWorldIsKnown) {
  const FrameState& frame = *window_.frames.front();
  EXPECT_EQ(AxesInCamera(window_, frame, rig_).size(), 3u);
  window_.headings.clear();
  const auto axes = AxesInCamera(window_, frame, rig_);
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT((axes[0] - Vector3d(0, -1, 0)).norm(), 1e-9);
}

}  // namespace
}  // namespace slcmap
