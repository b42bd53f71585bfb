#include "apps/evaluation/trajectory_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/evaluation/report.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

// A round of 20 m radius in 60 s that rises and sinks, at a given rate; it ends at its start.
Trajectory Circle(double rate_hz) {
  Trajectory trajectory;
  const int count = static_cast<int>(60 * rate_hz);
  for (int i = 0; i <= count; ++i) {
    const double angle = 2 * M_PI * i / count;
    StampedPose pose;
    pose.stamp_ns = 1000000000000 + ToNanoseconds(i / rate_hz);
    pose.T_world_imu = {ExpRotation({0, 0, angle}) * ExpRotation({0.1, 0.2 * std::sin(angle), 0}),
                        {20 * std::cos(angle), 20 * std::sin(angle), 2 * std::sin(2 * angle)}};
    trajectory.push_back(pose);
  }
  return trajectory;
}

Trajectory Moved(const RigidTransform& transform, Trajectory trajectory, double scale = 1) {
  for (StampedPose& pose : trajectory) {
    pose.T_world_imu.translation *= scale;
    pose.T_world_imu = transform * pose.T_world_imu;
  }
  return trajectory;
}

TrajectoryMetrics Evaluate(const Trajectory& truth, const Trajectory& estimate) {
  return EvaluateTrajectory(truth, estimate, {});
}

TEST(TrajectoryMetrics, PositionAndYawAreAlignedAway) {
  const Trajectory truth = Circle(20);
  const RigidTransform moved(ExpRotation({0, 0, 2.5}), {10, -20, 30});
  const TrajectoryMetrics metrics = Evaluate(truth, Moved(moved, truth));
  for (const AbsoluteError& error : metrics.absolute) {
    EXPECT_LT(error.position_m.max, 1e-9) << AlignmentName(error.kind);
    EXPECT_LT(error.rotation_deg.max, 1e-6) << AlignmentName(error.kind);
  }
  EXPECT_LT(metrics.relative[2].translation_rmse_percent, 1e-9);
  EXPECT_LT(metrics.loop.value().distance_m, 1e-9);
  const RigidTransform back = metrics.absolute[0].alignment.T_truth_estimate * moved;
  EXPECT_LT(back.translation.norm(), 1e-9);
}

TEST(TrajectoryMetrics, TiltAndScaleAreErrorsButForTheAlignmentsThatTakeThem) {
  const Trajectory truth = Circle(20);
  const TrajectoryMetrics tilted =
      Evaluate(truth, Moved({ExpRotation({0.02, 0, 0}), {1, 2, 3}}, truth));
  EXPECT_GT(tilted.absolute[0].position_m.rmse, 0.2);
  EXPECT_NEAR(tilted.absolute[0].rotation_deg.rmse, 0.02 / kDegree, 1e-3);
  EXPECT_LT(tilted.absolute[1].position_m.max, 1e-9);
  const TrajectoryMetrics metrics =
      Evaluate(truth, Moved({ExpRotation({0, 0, 1}), {1, 2, 3}}, truth, 0.9));
  EXPECT_GT(metrics.absolute[1].position_m.rmse, 1.9);
  EXPECT_LT(metrics.absolute[2].position_m.max, 1e-9);
  EXPECT_NEAR(metrics.absolute[2].alignment.scale, 1 / 0.9, 1e-9);
  // A chord is shorter by a tenth, whatever the piece.
  for (const RelativeError& error : metrics.relative) {
    EXPECT_NEAR(error.translation_rmse_percent, 10, 0.2) << error.length_m;
  }
}

TEST(TrajectoryMetrics, StatisticsOfKnownErrors) {
  const ErrorStatistics statistics = Statistics({4, 1, 2, 3});
  EXPECT_DOUBLE_EQ(statistics.rmse, std::sqrt(30.0 / 4));
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.median, 2.5);
  EXPECT_DOUBLE_EQ(statistics.max, 4);
  EXPECT_DOUBLE_EQ(Statistics({3, 1, 2}).median, 2);
}

TEST(TrajectoryMetrics, YawDriftShowsInRelativeError) {
  const Trajectory truth = Circle(20);
  Trajectory estimate = truth;
  const double rate_rad_m = 0.1 * kDegree;
  double travelled_m = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const RigidTransform motion = truth[i - 1].T_world_imu.Inverse() * truth[i].T_world_imu;
    const double step_m = motion.translation.norm();
    travelled_m += step_m;
    estimate[i].T_world_imu = estimate[i - 1].T_world_imu * motion *
                              RigidTransform(ExpRotation({0, 0, rate_rad_m * step_m}), {0, 0, 0});
  }
  const TrajectoryMetrics metrics = Evaluate(truth, estimate);
  EXPECT_NEAR(metrics.truth_length_m, travelled_m, 1e-6);
  EXPECT_NEAR(metrics.relative[1].rotation_rmse_deg_m, 0.1, 0.002);
  EXPECT_NEAR(metrics.relative[1].rotation_rmse_deg, 0.5, 0.02);
  EXPECT_EQ(metrics.relative[1].length_m, 5);
}

TEST(TrajectoryMetrics, LoopErrorIsTheGapBetweenStartAndEnd) {
  const Trajectory truth = Circle(20);
  Trajectory estimate = truth;
  const auto last = static_cast<double>(estimate.size() - 1);
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].T_world_imu.translation +=
        Eigen::Vector3d(0.3, 0, 0.4) * (static_cast<double>(i) / last);
  }
  const TrajectoryMetrics metrics = Evaluate(truth, estimate);
  EXPECT_NEAR(metrics.loop.value().distance_m, 0.5, 1e-9);
  EXPECT_NEAR(metrics.loop->percent, 50 / metrics.truth_length_m, 1e-9);
  const Trajectory half(truth.begin(), truth.begin() + 600);
  EXPECT_FALSE(Evaluate(half, half).loop.has_value());
}

TEST(TrajectoryMetrics, HeadingErrorIsOfTheLastPoseAgainstTheFirst) {
  const Trajectory truth = Circle(20);
  Trajectory estimate = Moved({ExpRotation({0, 0, 2.5}), {1, 2, 3}}, truth);
  EXPECT_NEAR(Evaluate(truth, estimate).heading_error_deg, 0, 1e-9);
  RigidTransform& last = estimate.back().T_world_imu;
  last.rotation = ExpRotation({0, 0, 3 * kDegree}) * last.rotation;
  EXPECT_NEAR(Evaluate(truth, estimate).heading_error_deg, 3, 1e-9);
  last.rotation = ExpRotation({0, 0, -8 * kDegree}) * last.rotation;
  EXPECT_NEAR(Evaluate(truth, estimate).heading_error_deg, -5, 1e-9);
  // A tilt is no heading.
  last.rotation = ExpRotation({0, 0, 5 * kDegree}) * ExpRotation({0.01, 0.02, 0}) * last.rotation;
  EXPECT_NEAR(Evaluate(truth, estimate).heading_error_deg, 0, 0.01);
}

TEST(TrajectoryMetrics, TruthIsInterpolatedAndItsGapsAreNotBridged) {
  Trajectory truth = Circle(200);
  Trajectory estimate = Circle(7);
  EXPECT_LT(Evaluate(truth, estimate).absolute[0].position_m.max, 1e-3);
  truth.erase(truth.begin() + 2000, truth.begin() + 4000);
  const TrajectoryMetrics metrics = Evaluate(truth, estimate);
  EXPECT_NEAR(static_cast<double>(metrics.poses.size()), 50 * 7, 2);
  EXPECT_EQ(metrics.estimated_poses, 421);
}

TEST(TrajectoryMetrics, CoverageCountsStampsWithoutAPose) {
  const Trajectory truth = Circle(200);
  Trajectory estimate = Circle(20);
  EXPECT_EQ(Evaluate(truth, estimate).coverage.overall, 1);
  EXPECT_EQ(Evaluate(truth, estimate).pieces, 1);

  const Trajectory late(estimate.begin() + 20, estimate.end());
  EXPECT_LT(Evaluate(truth, late).coverage.overall, 0.99);
  EXPECT_EQ(Evaluate(truth, late).coverage.after_initialisation, 1);
  EXPECT_FALSE(Evaluate(truth, late).coverage.flagged);

  estimate.erase(estimate.begin() + 600, estimate.begin() + 900);
  const TrajectoryMetrics holed = Evaluate(truth, estimate);
  EXPECT_NEAR(holed.coverage.overall, 0.75, 0.001);
  EXPECT_EQ(holed.pieces, 2);
  EXPECT_TRUE(holed.coverage.flagged);
}

TEST(TrajectoryMetrics, CoverageOfImagesCountsEachOnce) {
  const Trajectory truth = Circle(200);
  Trajectory estimate = Circle(20);
  std::vector<int64_t> images_ns;
  for (const StampedPose& pose : estimate) images_ns.push_back(pose.stamp_ns);
  estimate.erase(estimate.begin() + 500);
  const TrajectoryMetrics metrics = EvaluateTrajectory(truth, estimate, images_ns);
  EXPECT_DOUBLE_EQ(metrics.coverage.overall, 1200.0 / 1201);
  EXPECT_DOUBLE_EQ(metrics.coverage.after_initialisation, 1180.0 / 1181);
}

TEST(TrajectoryMetrics, StandingStillIsNoDivisionByZero) {
  Trajectory truth = Circle(20);
  for (StampedPose& pose : truth) pose.T_world_imu.translation = {1, 2, 3};
  Trajectory drifting = truth;
  drifting.back().T_world_imu.translation.x() += 0.05;
  const TrajectoryMetrics metrics = Evaluate(truth, drifting);
  EXPECT_LT(metrics.absolute[0].position_m.rmse, 0.05);
  EXPECT_TRUE(std::isnan(metrics.absolute[0].rmse_percent));
  EXPECT_EQ(metrics.relative[0].pieces, 0);
  EXPECT_TRUE(std::isnan(metrics.relative[0].translation_rmse_percent));
  EXPECT_FALSE(metrics.loop.has_value());
  EXPECT_TRUE(std::isfinite(metrics.absolute[2].alignment.scale));
  // The error of poses at rest means nothing.
  EXPECT_THROW(Evaluate(truth, truth), DataError);
  truth.resize(3);
  EXPECT_THROW(Evaluate(truth, truth), DataError);
}

TEST(TrajectoryMetrics, RefusesStrangersAndAbsurdOptions) {
  const Trajectory truth = Circle(20);
  Trajectory other = truth;
  for (StampedPose& pose : other) pose.stamp_ns += ToNanoseconds(1000);
  EXPECT_THROW(Evaluate(truth, other), DataError);
  EXPECT_THROW(EvaluateTrajectory(truth, truth, {}, 0), ConfigError);
}

// 100 poses along a line at 10 Hz; the estimate is 3 cm off sideways, left and right in turn.
TrajectoryMetrics MakeMetrics(std::size_t estimated) {
  Trajectory truth, estimate;
  for (int i = 0; i < 100; ++i) {
    truth.push_back({ToNanoseconds(0.1 * i), {Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}}});
    estimate.push_back(truth.back());
    estimate.back().T_world_imu.translation.z() += i % 2 == 0 ? 0.03 : -0.03;
  }
  estimate.resize(estimated);
  return EvaluateTrajectory(truth, estimate, {});
}

TEST(TrajectoryReport, TableAndJsonHoldTheFigures) {
  const EvaluationInputs inputs{"truth.csv", "run.tum", ""};
  const nlohmann::ordered_json json = TrajectoryJson(inputs, MakeMetrics(100));
  EXPECT_THAT(FiguresText(json),
              HasSubstr("ape posyaw position_m      rmse 0.03  mean 0.03  median 0.03  max 0.03"));
  EXPECT_NEAR(json["ape"]["posyaw"]["position_m"]["rmse"].get<double>(), 0.03, 1e-9);
  EXPECT_EQ(json["ape"]["sim3"]["alignment"].size(), 3u);
  EXPECT_EQ(json["rpe"][1]["length_m"], 5);
  EXPECT_EQ(json["rpe"][2]["pieces"], 0);
  EXPECT_TRUE(json["loop"].is_null());
  EXPECT_EQ(json["heading_error_at_end_deg"], 0);
  // Low coverage is flagged.
  const EvaluationInputs stamped{
      .truth = "truth.csv", .estimate = "run.tum", .stamps = "cam0/data.csv"};
  const auto coverage = TrajectoryJson(stamped, MakeMetrics(60))["coverage"];
  EXPECT_TRUE(coverage["flagged"]);
  EXPECT_EQ(coverage["overall"], 0.6);
  EXPECT_EQ(coverage["stamps"], "cam0/data.csv");
}

}  // namespace
}  // namespace slcmap
