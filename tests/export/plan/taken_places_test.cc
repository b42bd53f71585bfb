#include <gtest/gtest.h>

#include <cmath>

#include "export/plan/drawing.h"

namespace slcmap {
namespace {

TEST(TakenPlacesTest, BoxesThatAreTurnedOverlapWhereTheirAreasDo) {
  const Box upright = {{0, 0}, {1, 1}, 0};
  EXPECT_TRUE(Overlap(upright, {{1.9, 0}, {1, 1}, 0}));
  EXPECT_FALSE(Overlap(upright, {{2.1, 0}, {1, 1}, 0}));
  // Its bounding box would reach the upright one, it does not.
  EXPECT_FALSE(Overlap(upright, {{1.9, 1.9}, {1.2, 1.2}, M_PI / 4}));
  EXPECT_TRUE(Overlap(upright, {{1.9, 0}, {1.2, 1.2}, M_PI / 4}));
}

TEST(TakenPlacesTest, LinesMayCrossLinesButNeitherTextsNorWalls) {
  TakenPlaces taken;
  taken.AddLine({{0, 0}, {5, 0.1}, 0});
  taken.AddText({{0, 3}, {2, 0.5}, 0});
  const Box across = {{3, 0}, {5, 0.1}, M_PI / 2};
  EXPECT_TRUE(taken.HasRoomForLine(across, 0));
  EXPECT_FALSE(taken.HasRoomForText(across));
  EXPECT_FALSE(taken.HasRoomForLine({{0, 0}, {5, 0.1}, M_PI / 2}, 0));
  taken.AddWall({{3, 4}, {1, 0.5}, 0});
  EXPECT_FALSE(taken.HasRoomForLine(across, 1));
  EXPECT_TRUE(taken.HasRoomForLine(across, 1.6));
  EXPECT_TRUE(taken.IsAtWall({3, 4.55}, 0.1));
  EXPECT_FALSE(taken.IsAtWall({3, 4.65}, 0.1));
}

TEST(TakenPlacesTest, TextsAreReadFromBelowOrFromTheRight) {
  for (int degrees = 0; degrees < 360; degrees += 10) {
    const double angle_rad = degrees * M_PI / 180;
    const double read_rad = ReadableAngle({std::cos(angle_rad), std::sin(angle_rad)});
    EXPECT_LE(read_rad, M_PI / 2 + 0.05) << degrees;
    EXPECT_GT(read_rad, -M_PI / 2 + 0.04) << degrees;
    EXPECT_NEAR(std::sin(read_rad - angle_rad), 0, 1e-9) << degrees;
  }
}

}  // namespace
}  // namespace slcmap
