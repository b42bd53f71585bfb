#include "odometry/window/line_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "odometry/window/window_state.h"
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
  const LineDeviations deviations_{BuildingDeviationOptions{}};
};

TEST_F(LineLandmarksTest, AHeadingThatMostLinesAreOffIsWithdrawnWithTheOthers) {
  HeadingState& heading = *line().heading;
  heading.lines_given_up = kMinGivenUpOfHeading - 1;
  EXPECT_TRUE(RejectHeadings(&window_).empty()) << "few lines";
  heading.lines_given_up = 2 * kMinGivenUpOfHeading;
  heading.lines_kept = heading.lines_given_up;
  EXPECT_TRUE(RejectHeadings(&window_).empty()) << "as many follow it";
  EXPECT_TRUE(CollectHeadings(window_).front());
  heading.lines_kept = 1;
  EXPECT_THAT(RejectHeadings(&window_), ::testing::ElementsAre(int64_t{kLine}));
  EXPECT_TRUE(line().retired);
  EXPECT_FALSE(CollectHeadings(window_).front());
  EXPECT_TRUE(RejectHeadings(&window_).empty()) << "once";
}

TEST_F(LineLandmarksTest, RejectsAnObservationOfAnotherEdgeBeforeItMovesTheFrame) {
  See(kFrames - 1, 20);
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_FALSE(window_.frames.back()->lines.contains(kLine));
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

TEST_F(LineLandmarksTest, AnObservationThatWasRejectedIsNotTheLastReported) {
  EXPECT_EQ(Describe(line()).last_keyframe, kFrames - 1);
  See(kFrames - 1, 6 * options_.sigma_px);
  EXPECT_TRUE(RejectLineOutliers(options_, deviations_, model_, &window_).empty());
  EXPECT_EQ(Describe(line()).last_keyframe, kFrames - 2);
}

// It was seen only by frames that have left the window, until the wrong match.
TEST_F(LineLandmarksTest, SurvivesTheLossOfItsOnlyObservation) {
  line().released_frames = {0};
  for (int i = 0; i < kFrames - 1; ++i) window_.frames[i]->lines.clear();
  line().frames = {window_.frames.back().get()};
  line().extent.Add(-1, 1);
  See(kFrames - 1, 20);
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_TRUE(line().frames.empty());
  EXPECT_EQ(line().last_seen_frame(), 0);
  EXPECT_TRUE(RejectLineOutliers(options_, deviations_, model_, &window_).empty());
  ExtendLines(*window_.frames.back(), model_, &window_);
  EXPECT_TRUE(MergeLines(model_, &window_).empty());
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
  EXPECT_TRUE(RejectLineOutliers(options_, deviations_, model_, &window_).empty());
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

// Nearly along the axis, as the grain of wood is: no observation is far off, but all are.
TEST_F(LineLandmarksTest, RetiresALineWhoseObservationsAllMisfitALittle) {
  for (int i = 0; i < kFrames; ++i) See(i, 1.5 * options_.sigma_px);
  EXPECT_EQ(RejectLineOutliers(options_, deviations_, model_, &window_).count(kLine), 1u);
  EXPECT_TRUE(line().retired);
}

// The same edge under a second id, anchored 0.5 m further along the axis and seen by later frames.
class MergeLinesTest : public LineLandmarksTest {
 protected:
  void SetUp() override {
    LineLandmarksTest::SetUp();
    LineLandmark& newer = window_.lines.emplace(kNewer, line()).first->second;
    newer.id = kNewer;
    newer.frames.clear();
    newer.anchor_world += 0.5 * Vector3d::UnitX();
    line().extent.Add(-1, 1);
    newer.extent.Add(0, 2);  // from 0.5 to 2.5 along the older one
  }

  static constexpr int64_t kNewer = kLine + 1;
};

TEST_F(MergeLinesTest, TheOlderOneIsSeenAsFarAsBothWere) {
  EXPECT_EQ(MergeLines(model_, &window_), (std::map<int64_t, int64_t>{{kNewer, kLine}}));
  LineExtent expected;
  expected.Add(-1, 1);
  expected.Add(0.5, 2.5);
  EXPECT_NEAR(line().extent.from_m(), expected.from_m(), 1e-9);
  EXPECT_NEAR(line().extent.to_m(), expected.to_m(), 1e-9);
  line().extent.Add(-1, 2.5);  // once more as far as the outermost ends, which then count
  EXPECT_NEAR(line().extent.from_m(), -1, 1e-9);
  EXPECT_NEAR(line().extent.to_m(), 2.5, 1e-9);
}

TEST_F(MergeLinesTest, FramesThatHaveLeftCountOnce) {
  line().released_frames = {-5, -4};
  window_.lines.at(kNewer).released_frames = {-4, -3, -2};
  MergeLines(model_, &window_);
  EXPECT_EQ(line().released_frames, (std::vector<int64_t>{-5, -4, -3, -2}));
  EXPECT_EQ(Describe(line()).observations, kFrames + 4);
}

// The later half of the frames sees the line under a second id, moved so far in the camera.
class MergeMovedLinesTest : public MergeLinesTest {
 protected:
  void Move(const Vector3d& by_camera) {
    LineLandmark& newer = window_.lines.at(kNewer);
    const Vector3d p_world = At(0) + T_world_camera_.rotation * by_camera;
    const StructuralLineBlock block = StructuralLineThrough(newer.structural(), 0, p_world);
    std::copy(block.begin(), block.end(), newer.block.begin());
    for (int i = kFrames / 2; i < kFrames; ++i) {
      FrameState* frame = window_.frames[i].get();
      frame->lines[kNewer] = frame->lines.at(kLine);
      newer.frames.push_back(frame);
      frame->lines.erase(kLine);
      std::erase(line().frames, frame);
    }
  }
  bool AreMerged() { return !MergeLines(model_, &window_).empty(); }
};

// Across the view the lines are known to a millimetre, along it to some centimetres.
TEST_F(MergeMovedLinesTest, LinesAreOneWhereTheirUncertaintyAllows) {
  Move({0, 0, 0.02});
  EXPECT_TRUE(AreMerged());
}

TEST_F(MergeMovedLinesTest, LinesThatAreKnownToBeApartStayTwo) {
  Move({0, 0.02, 0});
  EXPECT_FALSE(AreMerged());
}

TEST_F(MergeMovedLinesTest, TheJambsOfADoorStayTwoHoweverUncertain) {
  Move({0, 0, 0.05});
  EXPECT_FALSE(AreMerged());
}

TEST_F(MergeMovedLinesTest, LinesThatOneImageShowsSideBySideStayTwo) {
  Move({0, 0, 0.02});
  FrameState* frame = window_.frames.back().get();
  frame->lines[kLine] = frame->lines.at(kNewer);
  line().frames.push_back(frame);
  LineSegment& left = frame->lines.at(kNewer).left;
  const Vector2d apart(0, 3 / kFocal_px);
  left = {left.start + apart, left.end + apart};
  EXPECT_FALSE(AreMerged());
  left = {left.start - apart, left.end - apart};
  EXPECT_TRUE(AreMerged());
}

}  // namespace
}  // namespace slcmap
