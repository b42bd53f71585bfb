// The estimator with lines that share a slope, on simulated tracks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data/core/math.h"
#include "odometry/run/run_queries.h"
#include "odometry/window/estimator.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

SimulatedRunOptions Stairs(uint64_t seed, double sloped_share = 0.3) {
  SimulatedRunOptions options;
  options.odometry.method = Method::kSlc;
  options.odometry.points.max_points = 60;
  options.odometry.keyframes.min_parallax_px = 16;
  options.odometry.keyframes.min_kept_share = 0.7;
  options.duration_s = 10;
  options.stand_still_s = 1;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.3;
  options.odometry.window.point_sigma_px = options.odometry.line_landmarks.sigma_px = 0.3;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  options.seed = seed;
  options.lines = LineTrackSimulatorOptions{.heading_rad = 0.3,
                                            .sloped_share = sloped_share,
                                            .slope_azimuth_rad = 0.3,
                                            .slope_elevation_rad = 31 * kDegree,
                                            .points_per_edge = 1};
  return options;
}

TEST(EstimatorWithSlopes, WhatLinesShareIsFoundAndTheyFollowIt) {
  const SimulatedRun run = RunOnSimulatedTracks(Stairs(4));
  ASSERT_EQ(run.run.sloped_directions.size(), 1u);
  const SlopedDirection& slope = run.run.sloped_directions[0];
  EXPECT_FALSE(slope.withdrawn);
  EXPECT_NEAR(slope.elevation_rad, 31 * kDegree, 0.1 * kDegree);
  EXPECT_GT(slope.elevation_sigma_rad, 0);
  EXPECT_LT(slope.elevation_sigma_rad, 0.1 * kDegree);
  EXPECT_LT(run.final_slope_error_rad.norm(), 0.1 * kDegree);
  int sloped = 0;
  for (const Line& line : run.run.lines) {
    const SimulatedEdge& edge = run.edges.at(static_cast<size_t>(line.id));
    EXPECT_EQ(line.axis == LineAxis::kSloped, edge.is_sloped) << line.id;
    if (line.axis != LineAxis::kSloped) continue;
    ++sloped;
    EXPECT_EQ(line.world, 0);
    if (line.observations < 6) continue;
    EXPECT_LT(line.deviation_rad, 4 * line.deviation_sigma_rad + 1e-3) << line.id;
  }
  EXPECT_GT(sloped, 5);
  EXPECT_LT(LargestPositionError(run), 0.04);
}

TEST(EstimatorWithSlopes, DirectionsThatLinesDoNotShareAreNone) {
  for (const uint64_t seed : {5, 6}) {
    SimulatedRunOptions options = Stairs(seed, 0);
    options.lines->general_share = 0.5;
    EXPECT_TRUE(RunOnSimulatedTracks(options).run.sloped_directions.empty());
  }
}

TEST(EstimatorWithSlopes, AreNotLookedForWhereTheyAreSwitchedOff) {
  SimulatedRunOptions options = Stairs(4);
  options.odometry.slopes.enabled = false;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_TRUE(run.run.sloped_directions.empty());
  EXPECT_TRUE(std::ranges::none_of(
      run.run.lines, [](const Line& line) { return line.axis == LineAxis::kSloped; }));
}

// The errors of pose and slope against what is claimed of them.
TEST(EstimatorWithSlopes, ErrorsAreAsLargeAsIsClaimed) {
  constexpr int kRuns = 4;
  double of_pose = 0, of_slope = 0;
  for (int i = 0; i < kRuns; ++i) {
    SimulatedRunOptions options = Stairs(20 + static_cast<uint64_t>(i));
    options.lines->deviation_rad = 0.1 * kDegree;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    ASSERT_GT(run.final_slope_nees, 0) << "it is known";
    of_slope += run.final_slope_nees / kRuns;
    of_pose += run.final_pose_nees / kRuns;
  }
  EXPECT_LT(of_slope, 5.5);  // 2, and sqrt(4 / 4) = 1
  EXPECT_LT(of_pose, 14);    // 6, and sqrt(12 / 4) = 1.7
}

}  // namespace
}  // namespace slcmap
