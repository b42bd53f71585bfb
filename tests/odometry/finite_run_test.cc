#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "odometry/run/run_queries.h"
#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

constexpr double kNotFinite = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(FiniteRun, AGoodRunStaysAsItIs) {
  const OdometryRun run = testing::MakeLineRun();
  ASSERT_TRUE(IsFinite(run));
  const OdometryRun kept = WithoutNonFinite(run);
  EXPECT_EQ(kept.states.size(), run.states.size());
  EXPECT_EQ(kept.landmarks.size(), run.landmarks.size());
  EXPECT_EQ(kept.lines.size(), run.lines.size());
  EXPECT_EQ(kept.warnings, run.warnings);
}

TEST(FiniteRun, WhatMappingIsHandedHoldsFiniteValuesOnly) {
  OdometryRun run = testing::MakeLineRun();
  run.states.front().gyro_bias_rad_s.z() = kNotFinite;
  run.keyframes.front().observations.front().left_px.x() = kInfinity;
  run.keyframes.back().T_world_imu.rotation.w() = kNotFinite;
  run.landmarks.back().p_world.x() = -kInfinity;
  run.lines.front().covariance_m2(0, 1) = kNotFinite;
  EXPECT_FALSE(IsFinite(run));
  const OdometryRun kept = WithoutNonFinite(run);
  EXPECT_TRUE(IsFinite(kept));
  EXPECT_EQ(kept.states.size() + 1, run.states.size());
  EXPECT_EQ(kept.keyframes.size() + 1, run.keyframes.size());
  EXPECT_EQ(kept.keyframes.front().observations.size() + 1,
            run.keyframes.front().observations.size());
  EXPECT_EQ(kept.landmarks.size() + 1, run.landmarks.size());
  EXPECT_EQ(kept.lines.size() + 1, run.lines.size());
  for (const char* kind : {"states", "keyframes", "observations", "landmarks", "lines"}) {
    EXPECT_EQ(kept.warnings.at(std::string(kind) + "_not_finite"), 1) << kind;
  }
}

// One at a time, so that none hides behind another of its element.
TEST(FiniteRun, EveryValueIsLookedAt) {
  const std::vector<double& (*)(OdometryRun&)> values = {
      [](OdometryRun& run) -> double& { return run.states[0].T_world_imu.translation.x(); },
      [](OdometryRun& run) -> double& { return run.states[0].T_world_imu.rotation.z(); },
      [](OdometryRun& run) -> double& { return run.states[0].velocity_world_m_s.y(); },
      [](OdometryRun& run) -> double& { return run.states[0].accel_bias_m_s2.x(); },
      [](OdometryRun& run) -> double& { return run.keyframes[0].T_world_imu.translation.x(); },
      [](OdometryRun& run) -> double& { return run.keyframes[0].observations[0].right_px->x(); },
      [](OdometryRun& run) -> double& { return run.keyframes[0].lines[0].left_px.end.y(); },
      [](OdometryRun& run) -> double& { return run.keyframes[0].lines[0].right_px->start.y(); },
      [](OdometryRun& run) -> double& { return run.landmarks[0].sigma_m; },
      [](OdometryRun& run) -> double& { return run.lines[0].start_world.z(); },
      [](OdometryRun& run) -> double& { return run.lines[0].end_world.z(); },
      [](OdometryRun& run) -> double& { return run.lines[0].covariance_m2(2, 2); },
      [](OdometryRun& run) -> double& { return run.manhattan_worlds[0].heading_rad; },
      [](OdometryRun& run) -> double& { return run.manhattan_worlds[0].sigma_rad; },
  };
  for (size_t i = 0; i < values.size(); ++i) {
    OdometryRun run = testing::MakeLineRun();
    ASSERT_TRUE(run.keyframes[0].observations[0].right_px && run.keyframes[0].lines[0].right_px);
    values[i](run) = kNotFinite;
    EXPECT_FALSE(IsFinite(run)) << i;
    EXPECT_TRUE(IsFinite(WithoutNonFinite(run))) << i;
  }
}

}  // namespace
}  // namespace slcmap
