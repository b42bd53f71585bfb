#include "odometry/finite_run.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
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
  run.states.front().gyro_bias_rad_s.z() = kNaN;
  run.keyframes.front().observations.front().left_px.x() = kInfinity;
  run.keyframes.back().T_world_imu.rotation.w() = kNaN;
  run.landmarks.back().p_world.x() = -kInfinity;
  run.lines.front().covariance_m2(0, 1) = kNaN;
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

}  // namespace
}  // namespace slcmap
