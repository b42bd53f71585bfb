#include <gtest/gtest.h>

#include "mapping/lines/line_samples.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::LookingAtWall;
using testing::PaintedWall;

// A screen of 1 m x 1 m at 2 m, in points every 4 cm that face the camera.
std::vector<DensePoint> DenseScreen(double normal_y = -1) {
  std::vector<DensePoint> points;
  for (int x = -12; x <= 12; ++x) {
    for (int z = -12; z <= 12; ++z) {
      DensePoint point;
      point.p_world = {0.04 * x, 2, 0.04 * z};
      point.normal_world = {0, normal_y, 0};
      points.push_back(point);
    }
  }
  return points;
}

ViewCameras OneView() {
  const Views views = {LookingAtWall({0, 0, 0}, 100)};
  return ViewCameras(views, PaintedWall(views, {}, 2).rig());
}

const Eigen::Vector2d kMiddle_px(239.5, 159.5);

TEST(VisibilityDepths, ASurfaceHidesWhatIsBehindIt) {
  const VisibilityDepths depths(DenseScreen(), 0.04, OneView());
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px, 3));
  EXPECT_TRUE(depths.Hides(0, 1, kMiddle_px, 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 2.05)) << "a line on it";
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 1));
}

TEST(VisibilityDepths, WhatIsBesideItIsNotHidden) {
  const VisibilityDepths depths(DenseScreen(), 0.04, OneView());
  // Its border is 75 px from the middle.
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(60, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(90, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, {-5, 20}, 3)) << "outside the image";
}

TEST(VisibilityDepths, BacksAndUnknownSurfacesHideNothing) {
  EXPECT_FALSE(VisibilityDepths(DenseScreen(1), 0.04, OneView()).Hides(0, 0, kMiddle_px, 3));
  EXPECT_FALSE(VisibilityDepths().Hides(0, 0, kMiddle_px, 3));
}

TEST(VisibilityDepths, OnceProgressSaysSoNothingIsHidden) {
  const VisibilityDepths depths(DenseScreen(), 0.04, OneView(),
                                Progress([](double) { return false; }));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 3));
}

}  // namespace
}  // namespace slcmap
