#include <gtest/gtest.h>

#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/scene/scene_objects.h"
#include "data/simulator/truth.h"
#include "tests/data/simulator/small_scenes.h"

namespace slcmap {
namespace {

std::vector<TruePipe> PipesSeen(const Scene& scene) {
  const RayScene rays(scene.quads);
  const RenderTask task = testing::SlidingTask(testing::SmallRig(Distortion::kNone),
                                               testing::LookingAlongX(), {0, 0, 0}, 1);
  return ObservePipes(scene, rays, task, 1);
}

Scene PipesAndScreen(bool with_screen) {
  SceneBuilder builder({Eigen::Isometry3d::Identity()});
  const uint32_t material = builder.AddMaterial({});
  builder.AddPipe({4, -1, 0}, {4, 1, 0}, 0.1, 12, material);
  builder.AddPipe({-4, -1, 0}, {-4, 1, 0}, 0.1, 12, material);     // behind
  builder.AddPipe({12, -1, 0}, {12, 1, 0}, 0.1, 12, material);     // beyond 8 m
  builder.AddRoundBar({3, 0, 1}, {3, 0.5, 1}, 0.1, 12, material);  // no pipe
  if (with_screen) builder.AddQuad({2, 0, -5}, {0, 10, 0}, {0, 0, 10}, material);
  return builder.Finish();
}

TEST(PipeTruth, SaysWhatWasSeenOfEachPipe) {
  const std::vector<TruePipe> pipes = PipesSeen(PipesAndScreen(false));
  ASSERT_EQ(pipes.size(), 3u);
  EXPECT_EQ(pipes[0].radius_m, 0.1);
  ASSERT_EQ(pipes[0].seen.size(), 1u);
  EXPECT_NEAR(pipes[0].SeenLength_m(), 2, 1e-9);
  EXPECT_TRUE(pipes[1].seen.empty());
  EXPECT_TRUE(pipes[2].seen.empty());
}

// The right camera, 0.1 m to the right, sees somewhat more behind the screen.
TEST(PipeTruth, WhatIsHiddenIsNotSeen) {
  const std::vector<TruePipe> pipes = PipesSeen(PipesAndScreen(true));
  ASSERT_EQ(pipes[0].seen.size(), 1u);
  EXPECT_NEAR(pipes[0].seen[0].from_m, 0, 1e-9);
  EXPECT_NEAR(pipes[0].seen[0].to_m, 1.1, 0.06);
}

TEST(PipeTruth, APipeRunHasItsPiecesAndFlanges) {
  SceneBuilder builder({Eigen::Isometry3d::Identity()});
  const uint32_t material = builder.AddMaterial({});
  AddPipeRun({{0, 0, 0}, {0, 0, 2}, {1, 0, 2}}, 0.05, 16, material, &builder);
  const Scene scene = builder.Finish();
  ASSERT_EQ(scene.pipes.size(), 4u);
  EXPECT_EQ(scene.pipes[0].radius_m, 0.05);
  EXPECT_EQ(scene.pipes[0].b, Eigen::Vector3d(0, 0, 2));
  EXPECT_LT((scene.pipes[1].b - scene.pipes[1].a).norm(), 0.1);
}

}  // namespace
}  // namespace slcmap
