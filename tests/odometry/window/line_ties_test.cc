#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST_F(LineTiesTest, ALineOfNoAxisBendsToo) {
  line().axis = LineAxis::kNone;
  line().heading = nullptr;
  line().block = GeneralLineThrough(line().anchor_world, At(0), Vector3d::UnitX());
  const double moved_m = 0.15 * (kTieFrames - 1);
  EXPECT_TRUE(FinishPieces(MakePieces(1.1 * moved_m), model_, &window_).empty());
  EXPECT_EQ(FinishPieces(MakePieces(0.9 * moved_m), model_, &window_).count(kLine), 1u);
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

}  // namespace
}  // namespace slcmap
