// The estimator in buildings whose lines are off the axes that they follow, on simulated tracks.
#include "odometry/window/estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "data/core/math.h"
#include "odometry/run/run_queries.h"
#include "tests/odometry/window/line_runs.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

SimulatedRunOptions Perfect(double duration_s = 12) {
  SimulatedRunOptions options;
  options.duration_s = duration_s;
  options.imu_rate_hz = 1000;  // the integration's error falls with the square of the step
  return options;
}

SimulatedRunOptions Noisy(uint64_t seed, double duration_s = 15) {
  SimulatedRunOptions options;
  options.duration_s = duration_s;
  options.imu_noise = true;
  options.pixel_sigma_px = 0.5;
  options.odometry.window.point_sigma_px = 0.5;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;  // as large as EuRoC's
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  options.seed = seed;
  return options;
}

TEST(Estimator, PerfectTracksGiveThePerfectPath) {
  const SimulatedRun run = RunOnSimulatedTracks(Perfect());
  ASSERT_GT(run.states.size(), 200u);
  EXPECT_LT(LargestPositionError(run), 3e-4);
  EXPECT_EQ(run.removed_points, 0u);
  EXPECT_EQ(run.states.back().segment, 0);
}

TEST(Estimator, StartsInMotionAndFindsLargeBiases) {
  for (const Method method : {Method::kPoints, Method::kPointsMono}) {
    SimulatedRunOptions options = Noisy(3);
    options.stand_still_s = 0;
    options.odometry.method = method;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    ASSERT_GT(run.states.size(), 250u) << MethodName(method);
    EXPECT_LT(LargestPositionError(run), method == Method::kPoints ? 0.15 : 0.3);
    EXPECT_LT((run.states.back().gyro_bias_rad_s - options.gyro_bias_rad_s).norm(), 2e-3);
    EXPECT_EQ(run.states.back().segment, 0);
  }
}

// Neither tells scale without the IMU; both tell more of the motion than one.
TEST(Estimator, TwoCamerasThatLookApartAreBothUsed) {
  SimulatedRunOptions perfect = Perfect();
  perfect.looks_apart = true;
  const SimulatedRun exact = RunOnSimulatedTracks(perfect);
  ASSERT_GT(exact.states.size(), 200u);
  EXPECT_LT(LargestPositionError(exact), 5e-3);
  EXPECT_EQ(exact.states.back().segment, 0);
  double of_one_m = 0, of_both_m = 0;
  for (const uint64_t seed : {3, 4, 5}) {
    SimulatedRunOptions options = Noisy(seed);
    options.stand_still_s = seed == 3 ? 0 : 2;
    options.looks_apart = true;
    const SimulatedRun both = RunOnSimulatedTracks(options);
    options.looks_apart = false;
    options.odometry.method = Method::kPointsMono;
    of_one_m += LargestPositionError(RunOnSimulatedTracks(options));
    of_both_m += LargestPositionError(both);
    EXPECT_EQ(both.states.back().segment, 0);
    std::array<int, 2> seen{};
    for (const KeyframeObservation& point : both.run.keyframes.back().observations) {
      ++seen[static_cast<size_t>(point.camera)];
    }
    EXPECT_GT(std::min(seen[0], seen[1]), 20);
  }
  EXPECT_LT(of_both_m, of_one_m);
}

// As before a bare wall: what the IMU loses meanwhile is less than what a new start would.
TEST(Estimator, SurvivesSecondsWithoutPoints) {
  SimulatedRunOptions options = Noisy(5);
  options.blind_from_s = 8;
  options.blind_to_s = 11;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_LT(LargestPositionError(run), 2);
}

TEST(Estimator, StartsANewSegmentAndSaysWhy) {
  using Spoil = std::function<void(SimulatedRunOptions*)>;
  const std::pair<const char*, Spoil> reasons[] = {
      {"a gap in the IMU samples, or a clock set to another time",
       [](SimulatedRunOptions* options) {
         options->imu_gap_from_s = 7;
         options->imu_gap_to_s = 7.6;
       }},
      {"a gap in the images",
       [](SimulatedRunOptions* options) {
         options->image_gap_from_s = 7;
         options->image_gap_to_s = 9.5;
       }},
      {"a view that moves with the rig, as a lift's cabin",
       [](SimulatedRunOptions* options) {
         options->stand_still_s = 7;
         options->lift_from_s = 4.2;
         options->lift_to_s = 5.4;
       }},
      {"no points to follow",
       [](SimulatedRunOptions* options) {
         options->duration_s = 18;
         options->blind_from_s = 6;
         options->blind_to_s = 13;
       }},
      {"the optimisation diverged", [](SimulatedRunOptions* options) {
         options->seed = 12;
         options->nan_from_s = 7;  // an observation that is not finite
         options->nan_to_s = 8;
       }}};
  for (const auto& [reason, spoil] : reasons) {
    SCOPED_TRACE(reason);
    SimulatedRunOptions options = Noisy(8);
    spoil(&options);
    const SimulatedRun run = RunOnSimulatedTracks(options);
    EXPECT_EQ(run.states.back().segment, 1);
    EXPECT_EQ(run.run.warnings.at(std::string("segments ended by ") + reason), 1);
    for (const OnlineState& state : run.states) {
      EXPECT_TRUE(state.gyro_bias_rad_s.allFinite() && state.T_world_imu.translation.allFinite());
    }
    const auto in_first = std::ranges::count(run.run.keyframes, 0, &Keyframe::segment);
    EXPECT_GT(in_first, 0);
    EXPECT_GT(std::ssize(run.run.keyframes) - in_first, 5);
  }
}

TEST(Estimator, OutliersAreRejected) {
  SimulatedRunOptions options = Noisy(9);
  options.outlier_share = 0.05;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_LT(LargestPositionError(run), 0.15);
  EXPECT_GT(run.removed_points, 50u);
}

// Corners found in noise, be it in both images of a pair, are gone in the next image: the share of
// kept points says nothing then.
TEST(Estimator, PointsThatNoOtherImageHasMakeNoKeyframes) {
  for (const Method method : {Method::kPoints, Method::kPointsMono}) {
    SimulatedRunOptions options = Noisy(11);
    options.odometry.method = method;
    const SimulatedRun calm = RunOnSimulatedTracks(options);
    options.noise_points = options.odometry.points.max_points;
    const SimulatedRun noisy = RunOnSimulatedTracks(options);
    EXPECT_LT(noisy.run.keyframes.size() * 10, calm.run.keyframes.size() * 12)
        << MethodName(method);
    EXPECT_GT(noisy.run.keyframes.size() * 10, calm.run.keyframes.size() * 8) << MethodName(method);
    EXPECT_LT(LargestPositionError(noisy), method == Method::kPoints ? 0.15 : 0.3);
    EXPECT_EQ(noisy.states.back().segment, 0);
  }
}

// Few points are averaged over more keyframes; those found in noise do not hide that they are few.
TEST(Estimator, WhereThereAreFewPointsKeyframesComeMoreOften) {
  const auto keyframes_per_s = [](int tracks, int noise_points) {
    SimulatedRunOptions options = Noisy(12);
    options.tracks = tracks;
    options.noise_points = noise_points;
    options.odometry.keyframes.min_parallax_px = 1000;
    options.odometry.keyframes.min_kept_share = 0;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    EXPECT_EQ(run.states.back().segment, 0);
    const double moving_s = options.duration_s - options.stand_still_s;
    return static_cast<double>(run.run.keyframes.size()) / moving_s;
  };
  EXPECT_LT(keyframes_per_s(160, 0), 1.8);
  EXPECT_GT(keyframes_per_s(50, 0), 3);
  const double beside_noise = keyframes_per_s(50, 110);
  EXPECT_GT(beside_noise, 3);
  EXPECT_LT(beside_noise, 5);
}

TEST(Estimator, ARestBeforeTheStartNeitherDriftsNorAddsKeyframes) {
  SimulatedRunOptions options = Noisy(10, 40);
  options.stand_still_s = 36;
  options.pixel_sigma_px = options.odometry.window.point_sigma_px = 0.3;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0) << "no lift";
  const auto rests = [](int64_t stamp_ns) { return stamp_ns < ToNanoseconds(35); };
  double drift_m = 0;
  for (const OnlineState& state : run.states) {
    if (!rests(state.stamp_ns)) break;
    const Eigen::Vector3d& first = run.states[0].T_world_imu.translation;
    drift_m = std::max(drift_m, (state.T_world_imu.translation - first).norm());
  }
  EXPECT_LT(drift_m, 0.01);
  EXPECT_LT(std::ranges::count_if(run.run.keyframes, rests, &Keyframe::stamp_ns), 10);
  EXPECT_LT(LargestPositionError(run), 0.05);
}

// Flies, comes to rest, and after rest_s flies back.
MotionSpline FlightWithRest(double flight_s, double rest_s) {
  const MotionSpline flight = ExampleFlight(ExampleStereoRig(), flight_s, 1);
  constexpr double kKnot_s = 0.1;
  std::vector<RigidTransform> control;
  for (double t_s = 0; t_s < 2 * flight_s + rest_s; t_s += kKnot_s) {
    control.push_back(flight.PoseAt(std::max({flight_s - t_s, t_s - flight_s - rest_s, 0.0})));
  }
  return MotionSpline(kKnot_s, control);
}

constexpr double kStop_s = 3;

// Rests for a second, rides along the view, stops from stop_s on for kStop_s, and rides on, so that
// what it looks at is far away while it stands.
MotionSpline RideWithStop(double stop_s, double duration_s) {
  constexpr double kKnot_s = 0.1, kSpeed_m_s = 0.8, kEase_s = 1.6;
  const Eigen::Quaterniond attitude = CameraLookingAlong(Eigen::Vector3d::UnitX()) *
                                      ExampleStereoRig().T_imu_camera[0].rotation.conjugate();
  std::vector<RigidTransform> control;
  double x_m = 0;
  for (double t_s = 0; t_s < duration_s; t_s += kKnot_s) {
    const double starting = (t_s - 1) / kEase_s, braking = (stop_s - t_s) / kEase_s,
                 going_on = (t_s - stop_s - kStop_s) / kEase_s;
    const double ride = std::max(std::min(starting, braking), going_on);
    x_m += kKnot_s * kSpeed_m_s * std::clamp(ride, 0.0, 1.0);
    control.emplace_back(attitude, Eigen::Vector3d(x_m, 0, 0));
  }
  return MotionSpline(kKnot_s, control);
}

// The last keyframe before a stop may show the rig while it still crept along its view.
TEST(Estimator, ComesToRestWhereItStops) {
  for (const double stop_s : {6.0, 6.2, 6.4}) {
    const MotionSpline motion = RideWithStop(stop_s, stop_s + kStop_s + 1);
    SimulatedRunOptions options = Noisy(12);
    options.pixel_sigma_px = options.odometry.window.point_sigma_px = 0.1;
    const SimulatedRun run = RunOnSimulatedTracks(options, &motion);
    const RigidTransform gauge = GaugeFromFirst(run);
    std::vector<Eigen::Vector3d> errors_m;
    for (size_t i = 0; i < run.states.size(); ++i) {
      const double t_s = ToSeconds(run.states[i].stamp_ns);
      if (t_s < stop_s - 0.5 || t_s > stop_s + kStop_s) continue;
      errors_m.push_back(gauge * run.states[i].T_world_imu.translation - run.truth[i].translation);
    }
    double largest_m = 0;
    for (const auto& error_m : errors_m) {
      largest_m = std::max(largest_m, (error_m - errors_m.front()).norm());
    }
    EXPECT_LT(largest_m, 0.015) << stop_s;
    EXPECT_EQ(run.states.back().segment, 0);
  }
}

TEST(Estimator, ARestOnTheWayNeitherAddsKeyframesNorTakesMemory) {
  constexpr double kRest_s = 45;
  SimulatedRunOptions options = Noisy(13);
  options.pixel_sigma_px = options.odometry.window.point_sigma_px = 0.3;
  options.image_rate_hz = 10;
  const MotionSpline motion = FlightWithRest(6, kRest_s);
  size_t most_samples = 0;
  const SimulatedRun run = RunOnSimulatedTracks(options, &motion, [&](Estimator* estimator) {
    for (const auto& frame : estimator->window().state().frames) {
      if (!frame->from_previous) continue;
      most_samples = std::max(most_samples, frame->from_previous->samples().size());
    }
  });
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_GT(most_samples, 10 * 200u);  // the rest did take place
  EXPECT_LT(most_samples, 25 * 200u);
  EXPECT_LT(LargestPositionError(run), 0.1);
  const auto resting = std::ranges::count_if(run.run.keyframes, [](const Keyframe& keyframe) {
    return keyframe.stamp_ns > ToNanoseconds(8) && keyframe.stamp_ns < ToNanoseconds(kRest_s);
  });
  EXPECT_LT(resting, 5);
}

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
