#include <gtest/gtest.h>

#include <cmath>

#include "odometry/frontend/line_segment.h"

namespace slcmap {
namespace {

const LineSegment kAlong{{10, 20}, {110, 20}};

TEST(LineGeometryTest, TheNormalPointsToTheLeftAsSeen) {
  EXPECT_EQ(Normal(kAlong), Eigen::Vector2d(0, -1));
  EXPECT_EQ(DistanceAcross_px(kAlong, {50, 17}), 3);
  EXPECT_EQ(PlaceAlong_px(kAlong, {50, 17}), 40);
  EXPECT_EQ(DistanceAcross_px(Reversed(kAlong), {50, 17}), -3);
}

TEST(LineGeometryTest, AnglesTellAReversedSegment) {
  EXPECT_NEAR(AngleBetween_rad(kAlong, Reversed(kAlong)), M_PI, 1e-12);
  EXPECT_NEAR(AngleBetween_rad(kAlong, {{0, 0}, {1, 1}}), M_PI / 4, 1e-12);
}

TEST(LineGeometryTest, OverlapIsNegativeOverAGap) {
  EXPECT_NEAR(Overlap_px(kAlong, {{60, 22}, {160, 22}}), 50, 1e-12);
  EXPECT_NEAR(Overlap_px(kAlong, {{160, 22}, {130, 22}}), -20, 1e-12);
}

TEST(LineGeometryTest, TheLargestDistanceIsTakenWhereBothAre) {
  const LineSegment tilted{{60, 20}, {160, 30}};
  EXPECT_NEAR(LargestDistance_px(kAlong, tilted), 5, 1e-12);
  EXPECT_NEAR(LargestDistance_px(kAlong, {{130, 23}, {160, 30}}), 3, 1e-12);
}

}  // namespace
}  // namespace slcmap
