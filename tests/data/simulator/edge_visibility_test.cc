#include <gtest/gtest.h>

#include "data/simulator/renderer.h"
#include "tests/data/simulator/small_scenes.h"

namespace slcmap {
namespace {

std::vector<SeenPart> SelectSeen(const Scene& scene) {
  const RayScene rays(scene.quads);
  const RenderTask task = testing::SlidingTask(testing::SmallRig(Distortion::kNone),
                                               testing::LookingAlongX(), {0, 0, 0}, 1);
  EdgeWatch watch(scene, rays, task);
  watch.Look(0);
  return watch.Parts();
}

// A wall at 4 m and a screen at 2 m that hides what is to the left of the axis from both cameras:
// the right one, 0.1 m to the right, sees the wall 0.1 m further behind the screen.
TEST(EdgeVisibilityTest, HiddenPartsAreNotSeen) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.quads.push_back({{2, 0, -5}, {0, 10, 0}, {0, 0, 10}, 0, {0, 0}});
  scene.edges = {{{4, -1, 0.3}, {4, 1, 0.3}, 1, 0}};
  const std::vector<SeenPart> seen = SelectSeen(scene);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].edge, 0);
  EXPECT_NEAR(seen[0].from_m, 0, 1e-9);
  EXPECT_NEAR(seen[0].to_m, 1.1, 0.03);
}

TEST(EdgeVisibilityTest, PartsOutsideTheViewAreNotSeen) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.edges = {{{-1, 0, 0}, {-2, 0, 0}, 0, 0},         // behind
                 {{4, 0, -9}, {4, 0, 9}, 2, 0},          // beyond both borders
                 {{3.99, 0, 40}, {3.99, 1, 40}, 1, 0}};  // far above
  const std::vector<SeenPart> seen = SelectSeen(scene);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].edge, 1);
  EXPECT_NEAR(seen[0].from_m, 9 - 4 * (119 - 61.7) / 114.5, 0.03);
  EXPECT_NEAR(seen[0].to_m, 9 + 4 * 61.7 / 114.5, 0.03);
}

TEST(EdgeVisibilityTest, RefusesEdgesWithoutEndAndStopsWhenAsked) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.edges = {{{4, -1, 0.3}, {4, 1e6, 0.3}, 1, 0}};
  const RayScene rays(scene.quads);
  RenderTask task = testing::SlidingTask(testing::SmallRig(Distortion::kNone),
                                         testing::LookingAlongX(), {0, 0, 0}, 1);
  EXPECT_THROW(EdgeWatch(scene, rays, task), ConfigError);
  scene.edges = {{{4, -1, 0.3}, {4, 1, 0.3}, 1, 0}};
  std::stop_source stop;
  stop.request_stop();
  task.stop = stop.get_token();
  EdgeWatch watch(scene, rays, task);
  EXPECT_THROW(watch.Look(0), StoppedError);
}

}  // namespace
}  // namespace slcmap
