#include "mapping/refinement.h"

#include <gtest/gtest.h>

#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

TEST(Refinement, PosesBetweenKeyframesFollowThem) {
  const OdometryRun run = testing::MakeWallRun();
  const Trajectory refined = RefineTrajectory(run.states, run.keyframes);
  ASSERT_EQ(refined.size(), run.states.size());
  EXPECT_NEAR(run.states.back().T_world_imu.translation.y(), 0.08, 1e-12);
  for (std::size_t i = 0; i < refined.size(); ++i) {
    EXPECT_EQ(refined[i].stamp_ns, run.states[i].stamp_ns);
    EXPECT_NEAR(refined[i].T_world_imu.translation.y(), 0, 1e-12);
    EXPECT_NEAR(refined[i].T_world_imu.translation.x(), 0.1 * static_cast<double>(i), 1e-12);
  }
}

TEST(Refinement, ARigidCorrectionMovesAllPosesAlike) {
  OdometryRun run = testing::MakeWallRun();
  const RigidTransform moved(ExpRotation({0.1, -0.2, 1.0}), {3, 2, 1});
  run.keyframes.erase(run.keyframes.begin() + 2, run.keyframes.end());
  for (Keyframe& keyframe : run.keyframes) {
    keyframe.T_world_imu =
        moved * run.states[static_cast<std::size_t>(10 * keyframe.id)].T_world_imu;
  }
  const Trajectory refined = RefineTrajectory(run.states, run.keyframes);
  for (std::size_t i = 0; i < refined.size(); ++i) {
    const RigidTransform expected = moved * run.states[i].T_world_imu;
    EXPECT_LT((refined[i].T_world_imu.translation - expected.translation).norm(), 1e-12);
    EXPECT_LT(refined[i].T_world_imu.rotation.angularDistance(expected.rotation), 1e-7);
  }
}

TEST(Refinement, SegmentsAreCorrectedByTheirOwnKeyframes) {
  OdometryRun run = testing::MakeWallRun();
  for (OnlineState& state : run.states) {
    if (state.T_world_imu.translation.x() > 2.5) state.segment = 1;
  }
  run.keyframes.resize(3);  // all of segment 0
  const Trajectory refined = RefineTrajectory(run.states, run.keyframes);
  EXPECT_NEAR(refined[20].T_world_imu.translation.y(), 0, 1e-12);
  EXPECT_EQ(refined[40].T_world_imu.translation.y(), run.states[40].T_world_imu.translation.y());
}

TEST(Refinement, WithoutKeyframesNothingChanges) {
  const OdometryRun run = testing::MakeWallRun();
  const Trajectory refined = RefineTrajectory(run.states, {});
  EXPECT_EQ(refined.back().T_world_imu.translation, run.states.back().T_world_imu.translation);
  EXPECT_TRUE(RefineTrajectory({}, run.keyframes).empty());
}

TEST(Refinement, KeyframesAreSortedByStamp) {
  OdometryRun run = testing::MakeWallRun();
  std::swap(run.keyframes[0], run.keyframes[3]);
  const Trajectory trajectory = KeyframeTrajectory(run.keyframes);
  ASSERT_EQ(trajectory.size(), 6u);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ(trajectory[i].T_world_imu.translation.x(), static_cast<double>(i));
  }
}

}  // namespace
}  // namespace slcmap
