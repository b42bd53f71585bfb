#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/simulator/ray_scene.h"
#include "tests/data/simulator/small_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A floor of 10 x 10 m around the origin, with a wall across it at x_m.
Scene FloorWithWall(float x_m) {
  Scene scene;
  scene.materials = {{TextureKind::kPlain, 0.5f, 0, 1}};
  scene.quads = {{{-5, -5, -1}, {10, 0, 0}, {0, 10, 0}, 0, {0, 0}},
                 {{x_m, -5, -1}, {0, 10, 0}, {0, 0, 3}, 0, {0, 0}}};
  return scene;
}

// From 0 m on along x, at `speed_m_s`, for two seconds.
RenderTask Along(double speed_m_s) {
  return testing::SlidingTask(testing::SmallRig(Distortion::kNone), testing::LookingAlongX(),
                              {speed_m_s, 0, 0}, 20);
}

TEST(CheckWay, AWayWithinTheRoomIsFine) {
  EXPECT_EQ(CheckWay(FloorWithWall(4), Along(1)).count, 0);
}

TEST(CheckWay, SaysWhereItPassesThroughAWall) {
  const WayCrossings crossings = CheckWay(FloorWithWall(0.51f), Along(1));
  EXPECT_EQ(crossings.count, 1);
  EXPECT_NEAR(crossings.first_s, 1.55, 0.06);
  EXPECT_NEAR(crossings.first_place_m.x(), 0.55, 0.06);
}

TEST(CheckWay, SaysWhereItPassesThroughGlass) {
  Scene scene = FloorWithWall(4);
  scene.panes = {{{0.51f, -5, -1}, {0, 10, 0}, {0, 0, 3}}};
  EXPECT_EQ(CheckWay(scene, Along(1)).count, 1);
}

TEST(CheckWay, SaysWhereItLeavesTheBuilding) {
  EXPECT_THAT(testing::MessageOf<ConfigError>([] { CheckWay(FloorWithWall(4), Along(8)); }),
              AllOf(HasSubstr("s into the motion the left camera is at (5."),
                    HasSubstr("outside the building"), HasSubstr("(-5.00, -5.00, -1.00)")));
}

}  // namespace
}  // namespace slcmap
