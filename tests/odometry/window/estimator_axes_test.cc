// The estimator in buildings whose lines are off the axes that they follow, on simulated tracks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "data/core/math.h"
#include "odometry/run/run_queries.h"
#include "odometry/window/estimator.h"
#include "tests/odometry/window/line_runs.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

SimulatedRunOptions Crooked(Method method, double deviation_rad, uint64_t seed) {
  SimulatedRunOptions options = NoisyLines(method, seed);
  SetPixelSigma(0.2, &options);
  options.lines->max_lines = 40;
  options.lines->deviation_rad = deviation_rad;
  return options;
}

// Errors of the angles between lines and their axes, squared and over their variances, of lines
// whose angle is told well.
std::vector<double> NormalisedDeviationErrors(const SimulatedRun& run) {
  std::vector<double> errors;
  for (const Line& line : run.run.lines) {
    const SimulatedEdge& edge = run.edges.at(static_cast<size_t>(line.id));
    if (line.axis == LineAxis::kNone || !edge.axis) continue;
    const Eigen::Vector3d axis = AxisDirection(static_cast<LineAxis>(*edge.axis), kHeading_rad);
    const double off_rad =
        std::asin(axis.cross((edge.end_world - edge.start_world).normalized()).norm());
    if (line.deviation_sigma_rad > 0.5 * off_rad) continue;
    errors.push_back(std::pow((line.deviation_rad - off_rad) / line.deviation_sigma_rad, 2));
  }
  return errors;
}

// No building is exact: taken as exact, its lines would be believed ten times too much.
TEST(EstimatorOffAxes, LearnsHowFarLinesAreOffTheirAxesAndStaysHonest) {
  constexpr int kRuns = 3;
  constexpr double kDeviation_rad = 0.005;
  std::map<bool, double> of_pose, error_m;
  double of_deviation = 0;
  size_t told = 0;
  for (int i = 0; i < kRuns; ++i) {
    for (const bool exact : {false, true}) {
      SimulatedRunOptions options = Crooked(Method::kSlc, kDeviation_rad, 300 + i);
      // Believed from the start, since the run is too short to find out.
      options.odometry.building_deviation.start_sigma_rad = exact ? 0 : 0.0017;
      const SimulatedRun run = RunOnSimulatedTracks(options);
      of_pose[exact] += run.final_pose_nees / kRuns;
      error_m[exact] += GetErrors(run).position_m / kRuns;
      if (exact) {
        EXPECT_EQ(std::ranges::count(run.run.lines, 0, &Line::deviation_sigma_rad),
                  std::ssize(run.run.lines));
        continue;
      }
      const std::vector<double> of_lines = NormalisedDeviationErrors(run);
      told += of_lines.size();
      of_deviation += std::accumulate(of_lines.begin(), of_lines.end(), 0.0);
      EXPECT_GT(run.run.line_deviation_rad, options.odometry.building_deviation.start_sigma_rad);
      EXPECT_LT(run.run.line_deviation_rad, 1.2 * kDeviation_rad);
    }
  }
  EXPECT_LT(of_pose[false], 12);  // 6, and sqrt(12 / 3) = 2
  EXPECT_GT(of_pose[true], 3 * of_pose[false]);
  EXPECT_GT(told, 20u);
  // 1 where it is known least, less elsewhere.
  EXPECT_LT(of_deviation / static_cast<double>(told), 3);
  EXPECT_GT(error_m[true], 1.2 * error_m[false]);
}

// Where hardly a line follows an axis, what is left is lines of none: else there would be points
// alone.
TEST(EstimatorOffAxes, InACrookedBuildingLinesOfNoAxisHelp) {
  double with_m = 0, without_m = 0;
  for (const uint64_t seed : {502, 503}) {
    SimulatedRunOptions options = Crooked(Method::kSlc, 1 * kDegree, seed);
    options.duration_s = 30;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    EXPECT_GT(std::ranges::count(run.run.lines, LineAxis::kNone, &Line::axis), 20);
    with_m += GetErrors(run).position_m;
    options.odometry.method = Method::kPoints;
    without_m += GetErrors(RunOnSimulatedTracks(options)).position_m;
  }
  EXPECT_LT(with_m, 0.8 * without_m);
}

TEST(EstimatorOffAxes, InAnExactBuildingAllLinesFollowAnAxis) {
  SimulatedRunOptions options = Crooked(Method::kSlc, 0, 500);
  options.lines->general_share = 0.3;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_GT(run.run.lines.size(), 20u);
  EXPECT_EQ(std::ranges::count(run.run.lines, LineAxis::kNone, &Line::axis), 0);
}

// The estimator with lines that share a slope, on simulated tracks.

SimulatedRunOptions Stairs(uint64_t seed, double sloped_share = 0.3) {
  SimulatedRunOptions options = NoisyLines(Method::kSlc, seed);
  AddStairs(sloped_share, &options);
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
  SimulatedRunOptions options = Stairs(5, 0);
  options.lines->general_share = 0.5;
  EXPECT_TRUE(RunOnSimulatedTracks(options).run.sloped_directions.empty());
}

TEST(EstimatorWithSlopes, AreNotLookedForWhereTheyAreSwitchedOff) {
  SimulatedRunOptions options = Stairs(4);
  options.odometry.slopes.enabled = false;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_TRUE(run.run.sloped_directions.empty());
  EXPECT_TRUE(std::ranges::none_of(
      run.run.lines, [](const Line& line) { return line.axis == LineAxis::kSloped; }));
}

}  // namespace
}  // namespace slcmap
