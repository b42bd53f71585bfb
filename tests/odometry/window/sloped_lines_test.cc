#include <gtest/gtest.h>

#include <cmath>

#include "data/core/math.h"
#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_priors.h"
#include "tests/odometry/window/line_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// A line before a rig that moves aslant, laid with an elevation.
class SlopedLinesTest : public testing::LineScene {
 protected:
  void SetUp() override {
    model_.geometry = StereoGeometry(rig_.T_imu_camera, kFocal_px / 0.4);
    model_.lines = StereoGeometry(rig_.T_imu_camera, kFocal_px / 0.2);
    LineLandmark& line = window_.lines[kLine];
    line.id = kLine;
    for (int i = 0; i < 5; ++i) {
      FrameState* frame = AddFrame(i, &line);
      const Vector3d half = 0.8 * direction_;
      frame->lines[kLine] = {{OnPlane(i, 0, At(0) - half), OnPlane(i, 0, At(0) + half)},
                             LineSegment{OnPlane(i, 1, At(0) - half), OnPlane(i, 1, At(0) + half)}};
    }
  }
  LineLandmark& line() { return window_.lines.at(kLine); }
  std::vector<FittedLine> Fits() {
    return FitFreeLines(options_, *window_.frames.back(), model_, window_);
  }
  void AddSlope(const SlopeBlock& angles_rad) {
    SlopeState& slope = window_.slopes.emplace_back();
    slope.index = static_cast<int>(window_.slopes.size()) - 1;
    slope.angles_rad = angles_rad;
  }

  const SlopeBlock slope_ = {0.2, 30 * kDegree};
  const Vector3d direction_ = SlopeDirection(slope_.data());
  const std::vector<Vector3d> axes_ = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  LineLandmarkOptions options_;
  LineDeviations deviations_{BuildingDeviationOptions{}};
};

TEST_F(SlopedLinesTest, ALineOfNoAxisIsFittedToItsObservations) {
  const std::vector<FittedLine> fits = Fits();
  ASSERT_EQ(fits.size(), 1u);
  const FreeLine& fit = fits[0].line;
  EXPECT_EQ(fit.id, kLine);
  EXPECT_LT(fit.direction_world.cross(direction_).norm(), 1e-6);
  EXPECT_LT((fit.middle_world - At(0)).norm(), 1e-4);
  EXPECT_NEAR(fit.length_m, 1.6, 1e-4);
  EXPECT_FALSE(line().estimated) << "it is only looked at";
  line().frames.resize(3);
  EXPECT_TRUE(Fits().empty()) << "too few observations";
}

TEST_F(SlopedLinesTest, ALineFollowsTheNearestSlopeAndRunsUpIt) {
  AddSlope({slope_[0], slope_[1] + 0.02});
  AddSlope({slope_[0], slope_[1] + 0.002});
  EXPECT_TRUE(FollowSlopes(axes_, Fits(), deviations_, &window_).empty());
  EXPECT_TRUE(line().estimated);
  EXPECT_EQ(line().axis, LineAxis::kSloped);
  EXPECT_EQ(line().slope, &window_.slopes[1]);
  EXPECT_GT(line().deviation_sigma_rad, 0);
  EXPECT_GT(line().InWorld().direction_world.dot(direction_), 0.999);
  ExtendLines(*window_.frames.back(), model_, &window_);
  EXPECT_EQ(Describe(line()).world, 1);
}

TEST_F(SlopedLinesTest, ALineFollowsNoSlopeThatIsFarOffOrWithdrawn) {
  AddSlope({slope_[0], slope_[1] + 0.06});
  AddSlope(slope_);
  window_.slopes[1].withdrawn = true;
  EXPECT_EQ(FollowSlopes(axes_, Fits(), deviations_, &window_).size(), 1u);
  EXPECT_EQ(line().axis, LineAxis::kNone);
}

TEST_F(SlopedLinesTest, ALineThatMayFollowAnAxisFollowsNoSlope) {
  AddSlope(slope_);
  std::vector<Vector3d> axes = axes_;
  axes.push_back(SlopeDirection(SlopeBlock{slope_[0], slope_[1] + 0.03}.data()));
  EXPECT_EQ(FollowSlopes(axes, Fits(), deviations_, &window_).size(), 1u);
}

TEST_F(SlopedLinesTest, ALineOffItsSlopeIsGivenUp) {
  AddSlope({slope_[0], slope_[1] + 0.01});
  FollowSlopes(axes_, Fits(), deviations_, &window_);
  BuildingDeviationOptions options;
  options.max_sigmas = 0.011 / options.start_sigma_rad;
  EXPECT_TRUE(RejectLinesOffSlope(LineDeviations(options), &window_).empty());
  options.max_sigmas = 0.009 / options.start_sigma_rad;
  EXPECT_EQ(RejectLinesOffSlope(LineDeviations(options), &window_).count(kLine), 1u);
  EXPECT_TRUE(line().retired);
  EXPECT_EQ(window_.slopes[0].lines_given_up, 1);
}

TEST_F(SlopedLinesTest, ASlopeMostOfWhoseLinesWereGivenUpIsWithdrawnWithTheRest) {
  AddSlope(slope_);
  FollowSlopes(axes_, Fits(), deviations_, &window_);
  SlopeState& slope = window_.slopes[0];
  slope.lines_given_up = kMinGivenUpOfSlope - 1;
  EXPECT_TRUE(RejectSlopes(&window_).empty()) << "these are few";
  slope.lines_given_up = kMinGivenUpOfSlope;
  slope.lines_kept = kMinGivenUpOfSlope;
  EXPECT_TRUE(RejectSlopes(&window_).empty()) << "as many follow it";
  slope.lines_kept = 0;
  EXPECT_EQ(RejectSlopes(&window_).count(kLine), 1u);
  EXPECT_TRUE(slope.withdrawn);
  EXPECT_TRUE(line().retired);
  EXPECT_EQ(CollectSlopes(window_).size(), 1u) << "or it would be found again at once";
}

}  // namespace
}  // namespace slcmap
