#include <gtest/gtest.h>

#include <limits>

#include "odometry/window/run_monitor.h"

namespace slcmap {
namespace {

constexpr int64_t kFigureStep_ns = 100'000'000;

TEST(RunningFigure, OfNothingIsNothing) {
  const FigureSummary summary = RunningFigure().Summary();
  EXPECT_EQ(summary.count, 0);
  EXPECT_EQ(summary.mean, 0);
  EXPECT_EQ(summary.worst, 0);
}

TEST(RunningFigure, HasAMeanAndThatOfTheWorstTwoSeconds) {
  RunningFigure figure;
  for (int i = 0; i < 200; ++i) figure.Add(i * kFigureStep_ns, i >= 100 && i < 120 ? 11 : 1);
  EXPECT_EQ(figure.Summary().count, 200);
  EXPECT_DOUBLE_EQ(figure.Summary().mean, 2);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 11);
}

TEST(RunningFigure, TheNewestSecondsCount) {
  RunningFigure figure;
  for (int i = 0; i < 25; ++i) figure.Add(i * kFigureStep_ns, i >= 20 ? 5 : 1);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 5);
}

TEST(RunningFigure, AFewValuesAreNoWorstSeconds) {
  RunningFigure figure;
  for (int i = 0; i < 20; ++i) figure.Add(i * kFigureStep_ns, 1);
  figure.Add(50 * kFigureStep_ns, 100);
  for (int i = 100; i < 120; ++i) figure.Add(i * kFigureStep_ns, 2);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 2);
}

TEST(RunningFigure, LeavesOutWhatIsNoNumber) {
  RunningFigure figure;
  figure.Add(0, 1);
  figure.Add(kFigureStep_ns, std::numeric_limits<double>::quiet_NaN());
  figure.Add(2 * kFigureStep_ns, std::numeric_limits<double>::infinity());
  EXPECT_EQ(figure.Summary().count, 1);
  EXPECT_EQ(figure.Summary().mean, 1);
}

}  // namespace
}  // namespace slcmap
