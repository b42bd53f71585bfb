#include "odometry/window/line_landmarks.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "data/simulator/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int64_t kLine = 7;
constexpr int kFrames = 6;
constexpr double kDepth_m = 3;
constexpr double kFocal_px = 450;

// A level rig that moves aslant past a line along X, and sees it as it is.
class LineLandmarksTest : public testing::Test {
 protected:
  void SetUp() override {
    model_.geometry = StereoGeometry(rig_.T_imu_camera, kFocal_px / 0.4);
    model_.lines = StereoGeometry(rig_.T_imu_camera, kFocal_px / options_.sigma_px);
    LineLandmark& line = window_.lines[kLine];
    line.id = kLine;
    line.axis = LineAxis::kX;
    line.heading = &window_.headings.emplace_back();
    line.anchor_world = T_world_camera_.translation;
    line.estimated = true;
    const StructuralLineBlock block = StructuralLineThrough(line.structural(), 0, Middle());
    std::copy(block.begin(), block.end(), line.block.begin());
    for (int i = 0; i < kFrames; ++i) {
      FrameState* frame = window_.frames.emplace_back(std::make_unique<FrameState>()).get();
      frame->id = i;
      PoseToBlock(Pose(i), frame->pose.data());
      See(i, 0);
      line.frames.push_back(frame);
    }
  }

  Vector3d Middle() const { return T_world_camera_ * Vector3d(0, 0, kDepth_m); }

  RigidTransform Pose(int i) const {
    return RigidTransform(Eigen::Quaterniond::Identity(),
                          R_world_camera_ * Vector3d(0.15 * i, 0.15 * i, 0)) *
           T_world_camera_ * rig_.T_imu_camera[0].Inverse();
  }

  // Frame i sees the line with one end down and the other up by so many pixels.
  void See(int i, double off_px) {
    std::array<LineSegment, 2> seen;
    for (int c = 0; c < 2; ++c) {
      const RigidTransform T_camera_world = (Pose(i) * rig_.T_imu_camera[c]).Inverse();
      const Vector3d start = T_camera_world * (Middle() - Vector3d::UnitX());
      const Vector3d end = T_camera_world * (Middle() + Vector3d::UnitX());
      const Vector2d off(0, off_px / kFocal_px);
      seen[c] = {start.head<2>() / start.z() + off, end.head<2>() / end.z() - off};
    }
    window_.frames[i]->lines[kLine] = {seen[0], seen[1]};
  }

  LineLandmark& line() { return window_.lines.at(kLine); }

  const Rig rig_ = ExampleStereoRig();
  const Eigen::Quaterniond R_world_camera_ = Eigen::Quaterniond(
      Eigen::Matrix3d((Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished()));
  const RigidTransform T_world_camera_{R_world_camera_, Vector3d(1, 2, 1.5)};
  const LineLandmarkOptions options_;
  CostModel model_;
  WindowState window_;
};

TEST_F(LineLandmarksTest, KeepsALineThatFits) {
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(line().frames.size(), kFrames);
}

TEST_F(LineLandmarksTest, TakesOutASightOfAnotherEdgeBeforeItMovesTheFrame) {
  See(kFrames - 1, 20);
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_FALSE(window_.frames.back()->lines.contains(kLine));
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

TEST_F(LineLandmarksTest, ASightThatWasTakenOutIsNotTheLastThatIsTold) {
  EXPECT_EQ(Describe(line(), model_, {}).last_keyframe, kFrames - 1);
  See(kFrames - 1, 6 * options_.sigma_px);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(Describe(line(), model_, {}).last_keyframe, kFrames - 2);
}

// It was seen only by frames that have left the window, until the wrong match.
TEST_F(LineLandmarksTest, SurvivesTheLossOfItsOnlySight) {
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

TEST_F(LineLandmarksTest, TakesOutTheRightSightAloneWhereItAloneIsOfAnotherEdge) {
  auto& sight = window_.frames.back()->lines.at(kLine);
  sight.right->start.y() += 20 / kFocal_px;
  RejectLineMisfits(options_, model_, window_.frames.back().get(), &window_);
  EXPECT_FALSE(sight.right);
  EXPECT_EQ(line().frames.size(), kFrames);
}

TEST_F(LineLandmarksTest, OneOutlierGoesAndTheLineStays) {
  See(2, 6 * options_.sigma_px);
  EXPECT_TRUE(RejectLineOutliers(options_, model_, &window_).empty());
  EXPECT_EQ(line().frames.size(), kFrames - 1);
}

// Nearly along the axis, as the grain of wood is: no sight is far off, but all are.
TEST_F(LineLandmarksTest, RetiresALineWhoseSightsAllMisfitALittle) {
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
