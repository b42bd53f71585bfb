#include "mapping/map/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

constexpr char kNotRefined[] =
    "poses not refined: no keyframe of their segment has the stamp of a state";

// Expects a number of poses that could not be refined.
Trajectory Refine(const OdometryRun& run, int64_t not_refined = 0) {
  std::map<std::string, int64_t> warnings;
  const Trajectory trajectory = RefineTrajectory(run, &warnings);
  EXPECT_EQ(warnings.contains(kNotRefined) ? warnings.at(kNotRefined) : 0, not_refined);
  return trajectory;
}

TEST(Refinement, PosesBetweenKeyframesFollowThem) {
  const OdometryRun run = testing::MakeWallRun();
  const Trajectory refined = Refine(run);
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
  const Trajectory refined = Refine(run);
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
  const auto in_second = std::ranges::count(run.states, 1, &OnlineState::segment);
  const Trajectory refined = Refine(run, in_second);
  EXPECT_NEAR(refined[20].T_world_imu.translation.y(), 0, 1e-12);
  EXPECT_EQ(refined[40].T_world_imu.translation.y(), run.states[40].T_world_imu.translation.y());
}

TEST(Refinement, WithoutKeyframesNothingChanges) {
  OdometryRun run = testing::MakeWallRun();
  run.keyframes.clear();
  std::map<std::string, int64_t> warnings;
  const Trajectory refined = RefineTrajectory(run, &warnings);
  EXPECT_EQ(refined.back().T_world_imu.translation, run.states.back().T_world_imu.translation);
  EXPECT_EQ(warnings.at(kNotRefined), std::ssize(run.states));
  run = testing::MakeWallRun();
  run.states.clear();
  warnings.clear();
  EXPECT_TRUE(RefineTrajectory(run, &warnings).empty());
  EXPECT_TRUE(warnings.empty());
}

// As of a run whose keyframes are on another clock than its states.
TEST(Refinement, KeyframesThatMatchNoStateAreReported) {
  OdometryRun run = testing::MakeWallRun();
  for (Keyframe& keyframe : run.keyframes) keyframe.stamp_ns += 20'000'000;
  const Trajectory refined = Refine(run, std::ssize(run.states));
  for (std::size_t i = 0; i < refined.size(); ++i) {
    EXPECT_EQ(refined[i].T_world_imu.translation, run.states[i].T_world_imu.translation);
  }
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
