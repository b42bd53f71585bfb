#include <gtest/gtest.h>

#include "odometry/window/window_state.h"
#include "tests/odometry/window/line_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

class LineViewsTest : public testing::LineScene {
 protected:
  void SetUp() override { AddFrame(0, &line_); }
  std::vector<Vector3d> Axes() const { return AxesInCamera(window_, *window_.frames[0], rig_); }
  LineLandmark line_;
};

TEST_F(LineViewsTest, TheVerticalIsAnAxisBeforeAnyWorldIsKnown) {
  const auto axes = Axes();
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT((axes[0] - Vector3d(0, -1, 0)).norm(), 1e-9);
  window_.headings.emplace_back();
  EXPECT_EQ(Axes().size(), 3u);
  window_.headings[0].withdrawn = true;
  EXPECT_EQ(Axes().size(), 1u);
}

TEST_F(LineViewsTest, SlopesAreAxesToo) {
  SlopeState& slope = window_.slopes.emplace_back();
  slope.angles_rad = {0, 0.5};  // up to the right
  const auto axes = Axes();
  ASSERT_EQ(axes.size(), 2u);
  EXPECT_LT((axes[1] - Vector3d(std::cos(0.5), -std::sin(0.5), 0)).norm(), 1e-9);
  slope.withdrawn = true;
  EXPECT_EQ(Axes().size(), 1u);
}

}  // namespace
}  // namespace slcmap
