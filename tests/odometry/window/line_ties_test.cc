#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/math.h"
#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_priors.h"
#include "odometry/window/window_state.h"
#include "tests/odometry/window/line_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int kTieFrames = 6;

class LineTiesTest : public testing::LineScene {
 protected:
  void SetUp() override {
    MakeLine(options_.sigma_px, &window_.headings.emplace_back(), &window_.lines[kLine]);
    for (int i = 0; i < kTieFrames; ++i) AddFrame(i, &line());
  }

  LineLandmark& line() { return window_.lines.at(kLine); }

  // Which gives up no line for being off its axis.
  static LineDeviations Loose() {
    BuildingDeviationOptions options;
    options.max_sigmas = 1e6;
    return LineDeviations(options);
  }
  static LineDeviations MakePieces(double max_piece_m) {
    BuildingDeviationOptions options;
    options.max_piece_m = max_piece_m;
    return LineDeviations(options);
  }

  static constexpr double kMaxDeviation_rad = 4e-3;
  const LineLandmarkOptions options_;
};

TEST_F(LineTiesTest, ALineIsOffItsAxisByAnAngleHoweverTightlyItIsTied) {
  const PointAndDirection in_world = line().InWorld();
  const Vector3d across = in_world.direction_world.unitOrthogonal();
  EXPECT_FALSE(IsOffAxis(line(), kMaxDeviation_rad)) << "exactly along it";
  for (const double tie_rad : {1e-4, 1e-3}) {
    line().deviation_sigma_rad = tie_rad;
    for (const double off_rad : {0.0, 3.9e-3, -3.9e-3, 4.1e-3, 20e-3}) {
      line().block = GeneralLineThrough(line().anchor_world, in_world.point_world,
                                        in_world.direction_world + off_rad * across);
      EXPECT_EQ(IsOffAxis(line(), kMaxDeviation_rad), std::abs(off_rad) > kMaxDeviation_rad)
          << off_rad;
      EXPECT_EQ(RejectLineOutliers(options_, Loose(), model_, &window_).count(kLine), 0u);
    }
  }
}

// Walls bend: what is seen of the edge further on is another line.
TEST_F(LineTiesTest, ALineThatMayDeviateIsFinishedOnceTheRigHasMovedAlongIt) {
  line().extent.Add(-1, 1);
  const double moved_m = 0.15 * (kTieFrames - 1);
  EXPECT_TRUE(FinishPieces(MakePieces(0.9 * moved_m), model_, &window_).empty())
      << "exactly along its axis";
  line().deviation_sigma_rad = 1e-3;
  line().block = GeneralLineThrough(line().anchor_world, At(0), Vector3d::UnitX());
  EXPECT_TRUE(FinishPieces(MakePieces(1.1 * moved_m), model_, &window_).empty());
  EXPECT_THAT(FinishPieces(MakePieces(0.9 * moved_m), model_, &window_),
              ::testing::ElementsAre(int64_t{kLine}));
  EXPECT_TRUE(FinishPieces(MakePieces(0.9 * moved_m), model_, &window_).empty()) << "once";
  EXPECT_TRUE(PredictLines(window_, *window_.frames.back(), rig_).empty());
  FrameState later;
  later.lines[kLine] = ObservationOf(kTieFrames);
  RegisterLines(&later, &window_);
  EXPECT_TRUE(later.lines.empty());
  EXPECT_EQ(line().frames.size(), kTieFrames) << "what was seen of it stays";
  line().retired = line().finished = false;
  line().axis = LineAxis::kNone;
  EXPECT_EQ(FinishPieces(MakePieces(0.9 * moved_m), model_, &window_).count(kLine), 1u)
      << "of no axis";
}

TEST_F(LineTiesTest, LinesOfAnAxisShareWhatTheyAreOffWhereTheyAreNear) {
  const LineDeviations deviations{BuildingDeviationOptions{}};
  line().deviation_sigma_rad = 1e-3;
  line().block = GeneralLineThrough(line().anchor_world, At(0), Vector3d::UnitX());
  const auto add = [&](int64_t id, const Vector3d& by, LineAxis axis) {
    LineLandmark& other = window_.lines.emplace(id, line()).first->second;
    other.anchor_world += by;
    other.axis = axis;
    if (axis == LineAxis::kVertical) other.heading = nullptr;
  };
  add(20, {1, 0, 0}, LineAxis::kX);
  add(21, {9, 0, 0}, LineAxis::kX);
  add(22, {0, 0, 0}, LineAxis::kVertical);
  AddDirectionPriors(deviations, &window_);
  EXPECT_EQ(line().shared, window_.lines.at(20).shared);
  EXPECT_EQ(window_.shared_deviations.size(), 3u);
  for (const auto& shared : window_.shared_deviations) {
    EXPECT_NEAR(std::hypot(shared.sigma_rad, line().deviation_sigma_rad),
                deviations.Of(shared.axis).sigma_rad(), 1e-12);
  }
  std::vector<Term> terms;
  std::vector<double*> dropped;
  ReleaseShared({21, 20}, &window_, &terms, &dropped);
  EXPECT_EQ(dropped, std::vector{window_.lines.at(21).shared->off_rad.data()});
  EXPECT_EQ(terms.size(), 1u);
  for (const int64_t id : {20, 21}) window_.lines.erase(id);
  RemoveShared(&window_);
  EXPECT_EQ(window_.shared_deviations.size(), 2u);
}

class LineViewsTest : public testing::LineScene {
 protected:
  void SetUp() override { AddFrame(0, &line_); }
  std::vector<Vector3d> Axes() const { return AxesInCamera(window_, *window_.frames[0], rig_); }
  LineLandmark line_;
};

TEST_F(LineViewsTest, TheVerticalIsAnAxisBeforeAnyWorldIsKnownAndSlopesAreToo) {
  const auto axes = Axes();
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT((axes[0] - Vector3d(0, -1, 0)).norm(), 1e-9);
  window_.headings.emplace_back();
  EXPECT_EQ(Axes().size(), 3u);
  window_.headings[0].withdrawn = true;
  EXPECT_EQ(Axes().size(), 1u);
  SlopeState& slope = window_.slopes.emplace_back();
  slope.angles_rad = {0, 0.5};  // up to the right
  ASSERT_EQ(Axes().size(), 2u);
  EXPECT_LT((Axes()[1] - Vector3d(std::cos(0.5), -std::sin(0.5), 0)).norm(), 1e-9);
  slope.withdrawn = true;
  EXPECT_EQ(Axes().size(), 1u);
}

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
