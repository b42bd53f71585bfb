#include "odometry/window/estimator.h"

#include <gtest/gtest.h>

#include <functional>
#include <utility>

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

TEST(Estimator, TheErrorFallsWithTheNoise) {
  double last_m = 1e9;
  for (const double sigma_px : {0.5, 0.05, 0.005}) {
    SimulatedRunOptions options = Perfect();
    options.pixel_sigma_px = sigma_px;
    options.odometry.window.point_sigma_px = sigma_px;
    const double error_m = LargestPositionError(RunOnSimulatedTracks(options));
    EXPECT_LT(error_m, 0.6 * last_m) << sigma_px;
    last_m = error_m;
  }
  EXPECT_LT(last_m, 2e-3);
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

TEST(Estimator, ClaimsTheCovarianceThatItsErrorsHave) {
  constexpr int kRuns = 12;
  double of_pose = 0, of_all = 0;
  for (int i = 0; i < kRuns; ++i) {
    const SimulatedRun run = RunOnSimulatedTracks(Noisy(100 + i, 10));
    of_pose += run.final_pose_nees / kRuns;
    of_all += run.final_nees / kRuns;
  }
  // Expected 6 and 15, with standard deviations of sqrt(2 n / 12) = 1.0 and 1.6.
  EXPECT_GT(of_pose, 3);
  EXPECT_LT(of_pose, 10);
  EXPECT_GT(of_all, 10);
  EXPECT_LT(of_all, 22);
}

// As before a bare wall: what the IMU loses meanwhile is less than what a new start would.
TEST(Estimator, SurvivesSecondsWithoutPoints) {
  for (const auto& [blind_s, most_m] : {std::pair(1.0, 0.5), std::pair(3.0, 2.0)}) {
    SimulatedRunOptions options = Noisy(5);
    options.blind_from_s = 8;
    options.blind_to_s = 8 + blind_s;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    EXPECT_EQ(run.states.back().segment, 0) << blind_s;
    EXPECT_LT(LargestPositionError(run), most_m) << blind_s;
  }
}

TEST(Estimator, LongBlindnessStartsANewSegmentWhereTheOldOneEnded) {
  SimulatedRunOptions options = Noisy(6, 20);
  options.blind_from_s = 6;
  options.blind_to_s = 13;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 1);
  const auto second = std::find_if(run.states.begin(), run.states.end(),
                                   [](const OnlineState& s) { return s.segment == 1; });
  ASSERT_NE(second, run.states.end());
  EXPECT_GT(ToSeconds(run.states.back().stamp_ns - second->stamp_ns), 3);
  const auto in_first = std::count_if(run.run.keyframes.begin(), run.run.keyframes.end(),
                                      [](const Keyframe& k) { return k.segment == 0; });
  EXPECT_GT(in_first, 5);
  EXPECT_GT(run.run.keyframes.size() - in_first, 5u);
  EXPECT_EQ(run.run.warnings.at("segments ended by no points to follow"), 1);
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
  }
}

TEST(Estimator, SevenSecondsAtRestAreNoLift) {
  SimulatedRunOptions options = Noisy(8);
  options.stand_still_s = 7;
  EXPECT_EQ(RunOnSimulatedTracks(options).states.back().segment, 0);
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
  EXPECT_GT(keyframes_per_s(50, 110), 3);
  EXPECT_LT(keyframes_per_s(50, 110), 5);
}

TEST(Estimator, StandingStillNeitherDriftsNorAddsKeyframes) {
  SimulatedRunOptions options = Noisy(10, 40);
  options.stand_still_s = 36;
  options.pixel_sigma_px = options.odometry.window.point_sigma_px = 0.3;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  double largest_m = 0;
  for (size_t i = 0; i < run.states.size(); ++i) {
    if (ToSeconds(run.states[i].stamp_ns) > 35) break;
    largest_m = std::max(
        largest_m,
        (run.states[i].T_world_imu.translation - run.states[0].T_world_imu.translation).norm());
  }
  EXPECT_LT(largest_m, 0.01);
  const auto early = std::count_if(run.run.keyframes.begin(), run.run.keyframes.end(),
                                   [](const Keyframe& k) { return ToSeconds(k.stamp_ns) < 35; });
  EXPECT_LT(early, 10);
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
  constexpr double kDuration_s = 18;
  for (const double stop_s : {6.0, 6.2, 6.4}) {
    const MotionSpline motion = RideWithStop(stop_s, kDuration_s);
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

TEST(Estimator, FiveMinutesAtRestTakeNoMoreMemoryThanAFew) {
  SimulatedRunOptions options = Noisy(13);
  options.pixel_sigma_px = options.odometry.window.point_sigma_px = 0.3;
  options.image_rate_hz = 10;
  options.odometry.points.max_points = 40;
  const MotionSpline motion = FlightWithRest(6, 300);
  size_t most_samples = 0, most_frames = 0;
  const SimulatedRun run = RunOnSimulatedTracks(options, &motion, [&](Estimator* estimator) {
    for (const auto& frame : estimator->window().state().frames) {
      if (frame->from_previous) {
        most_samples = std::max(most_samples, frame->from_previous->samples().size());
      }
    }
    most_frames = std::max(most_frames, estimator->window().state().frames.size());
  });
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_GT(most_samples, 10 * 200u);  // the rest did take place
  EXPECT_LT(most_samples, 25 * 200u);
  EXPECT_LT(LargestPositionError(run), 0.1);
  const auto resting = std::count_if(
      run.run.keyframes.begin(), run.run.keyframes.end(), [](const Keyframe& keyframe) {
        return keyframe.stamp_ns > ToNanoseconds(10) && keyframe.stamp_ns < ToNanoseconds(300);
      });
  EXPECT_LT(resting, 5);
}

}  // namespace
}  // namespace slcmap
