#include "mapping/map/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "data/core/math.h"
#include "data/core/rigid_transform.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

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
  const Trajectory refined = Refine(run, std::ssize(run.states));
  EXPECT_EQ(refined.back().T_world_imu.translation, run.states.back().T_world_imu.translation);
  run.states.clear();
  EXPECT_TRUE(Refine(run).empty());
}

TEST(Refinement, KeyframesAreSortedByStamp) {
  OdometryRun run = testing::MakeWallRun();
  std::swap(run.keyframes[0], run.keyframes[3]);
  const Trajectory trajectory = KeyframeTrajectory(run.keyframes);
  EXPECT_TRUE(std::ranges::is_sorted(trajectory, {}, &StampedPose::stamp_ns));
  EXPECT_EQ(trajectory.at(3).T_world_imu.translation.x(), 3);
}

constexpr int64_t kImu_ns = 5'000'000, kFrame_ns = 50'000'000;
constexpr double kEnd_s = 6;
const Vector3d kGyroBias_rad_s(0.01, -0.02, 0.015), kAccelBias_m_s2(0.1, 0.05, -0.08);

// A rig that swings along x and z while it turns about z.
struct Swing {
  static RigidTransform PoseAt(double t_s) {
    return {ExpRotation({0, 0, 0.8 * std::sin(1.5 * t_s)}),
            {0.6 * std::sin(2 * t_s), 0.4 * t_s, 0.1 * std::cos(3 * t_s)}};
  }
  static ImuSample SampleAt(int64_t stamp_ns) {
    const double t_s = ToSeconds(stamp_ns);
    const Vector3d acceleration(-2.4 * std::sin(2 * t_s), 0, -0.9 * std::cos(3 * t_s));
    const Vector3d up(0, 0, kGravity_m_s2);
    return {stamp_ns, Vector3d(0, 0, 1.2 * std::cos(1.5 * t_s)) + kGyroBias_rad_s,
            PoseAt(t_s).rotation.conjugate() * (acceleration + up) + kAccelBias_m_s2};
  }
};

// Keyframes at the truth, `every` frames; online poses that drift sideways by 10 cm/s from each
// keyframe to the next, and jump back there.
OdometryRun SwingRun(int every) {
  OdometryRun run;
  for (int64_t t = 0; ToSeconds(t) <= kEnd_s + 0.5; t += kImu_ns) {
    run.imu.push_back(Swing::SampleAt(t));
  }
  for (int i = 0; i * ToSeconds(kFrame_ns) <= kEnd_s; ++i) {
    const int64_t stamp_ns = i * kFrame_ns;
    const RigidTransform truth = Swing::PoseAt(ToSeconds(stamp_ns));
    OnlineState state{.stamp_ns = stamp_ns, .T_world_imu = truth};
    state.T_world_imu.translation.y() += 0.1 * ToSeconds(i % every * kFrame_ns);
    state.gyro_bias_rad_s = kGyroBias_rad_s;
    state.accel_bias_m_s2 = kAccelBias_m_s2;
    run.states.push_back(state);
    if (i % every == 0) run.keyframes.push_back({i, 0, stamp_ns, truth, {}, {}});
  }
  return run;
}

struct LargestErrors {
  double position_m = 0, rotation_rad = 0;
};

LargestErrors GetErrors(const OdometryRun& run) {
  std::map<std::string, int64_t> warnings;
  LargestErrors largest;
  for (const StampedPose& pose : RefineTrajectory(run, &warnings)) {
    const RigidTransform truth = Swing::PoseAt(ToSeconds(pose.stamp_ns));
    const RigidTransform error = truth.Inverse() * pose.T_world_imu;
    largest.position_m = std::max(largest.position_m, error.translation.norm());
    largest.rotation_rad = std::max(largest.rotation_rad, LogRotation(error.rotation).norm());
  }
  EXPECT_TRUE(warnings.empty());
  return largest;
}

TEST(InertialPath, OnlinePosesThatJumpAtKeyframesAreNotFollowed) {
  const OdometryRun run = SwingRun(6);
  const LargestErrors errors = GetErrors(run);
  EXPECT_LT(errors.position_m, 3e-4);  // of 15 mm
  EXPECT_LT(errors.rotation_rad, 1e-5);
  OdometryRun without = run, off = run;
  without.imu.clear();
  EXPECT_GT(GetErrors(without).position_m, 0.02);
  for (OnlineState& state : off.states) {  // constant errors of the IMU change little
    state.accel_bias_m_s2 += Vector3d(0.02, -0.02, 0.02);
    state.gyro_bias_rad_s += Vector3d(0.002, 0.002, -0.002);
  }
  EXPECT_LT(GetErrors(off).position_m, 7e-4);  // 0.035 m/s^2 bend 0.3 s by 0.4 mm
  EXPECT_LT(GetErrors(off).rotation_rad, 1e-4);
}

TEST(InertialPath, OverASecondOdometryTellsWhatTheForceIsOffBy) {
  OdometryRun run = SwingRun(24);
  for (OnlineState& state : run.states) {
    state.T_world_imu = Swing::PoseAt(ToSeconds(state.stamp_ns));
    state.accel_bias_m_s2.z() += 0.05;
  }
  EXPECT_LT(GetErrors(run).position_m, 4e-3);  // 9 mm otherwise
}

// The true poses of every frame from 1 s on.
Trajectory MakePath(double duration_s) {
  Trajectory path;
  for (int64_t t = ToNanoseconds(1); ToSeconds(t) <= 1 + duration_s; t += kFrame_ns) {
    path.push_back({t, Swing::PoseAt(ToSeconds(t))});
  }
  return path;
}

TEST(InertialPath, LongWaysMissingSamplesAndFaultsAreLeftToOdometry) {
  const OdometryRun run = SwingRun(6);
  const auto follows = [&](const OdometryRun& imu, double duration_s) {
    Trajectory path = MakePath(duration_s);
    return InertialPath(imu).Follow(run.states.front(), &path);
  };
  EXPECT_TRUE(follows(run, 0.3));
  EXPECT_TRUE(follows(run, 0.8));
  EXPECT_FALSE(follows(run, 1.6));
  OdometryRun gap = run, none = run, shocked = run, turned = run;
  std::erase_if(gap.imu, [](const ImuSample& sample) {
    return std::abs(ToSeconds(sample.stamp_ns) - 1.1) < 0.02;
  });
  none.imu.clear();
  for (ImuSample& sample : shocked.imu) sample.specific_force_m_s2.x() += 0.6;
  for (ImuSample& sample : turned.imu) sample.angular_velocity_rad_s.z() += 0.05;
  EXPECT_FALSE(follows(gap, 0.3));
  EXPECT_FALSE(follows(none, 0.3));
  EXPECT_FALSE(follows(shocked, 0.8));
  EXPECT_FALSE(follows(turned, 0.8));
}

// The clock and the turn of the IMU that the run has found.
TEST(InertialPath, KnowsTheRunsCalibration) {
  OdometryRun run = SwingRun(6);
  const Vector3d turn_rad(0.01, -0.02, 0.03);
  run.rectified_rig.camera_time_offset_s = 0.006;
  run.calibration.push_back({.time_offset_s = 0.004, .imu_rotation_rad = turn_rad});
  for (ImuSample& sample : run.imu) {
    sample = Swing::SampleAt(sample.stamp_ns);
    const Eigen::Quaterniond R_true_given = ExpRotation(-turn_rad);
    sample.stamp_ns += ToNanoseconds(0.01);
    sample.angular_velocity_rad_s =
        R_true_given * (sample.angular_velocity_rad_s - kGyroBias_rad_s) + kGyroBias_rad_s;
    sample.specific_force_m_s2 =
        R_true_given * (sample.specific_force_m_s2 - kAccelBias_m_s2) + kAccelBias_m_s2;
  }
  run.imu.insert(run.imu.begin(), run.imu.front());
  run.imu.front().stamp_ns -= ToNanoseconds(0.01);
  const LargestErrors errors = GetErrors(run);
  EXPECT_LT(errors.position_m, 3e-4);
  EXPECT_LT(errors.rotation_rad, 1e-4);
}

using RunLine = decltype(OdometryRun::lines)::value_type;

Vector3d Level(double angle_deg) {
  return {std::cos(angle_deg * kDegree), std::sin(angle_deg * kDegree), 0};
}

RunLine LineAlong(int64_t id, LineAxis axis, int world, const Vector3d& direction,
                  double length_m) {
  RunLine line;
  line.id = id;
  line.axis = axis;
  line.world = world;
  line.start_world = {2, 1, 0.5};
  line.end_world = line.start_world + length_m * direction;
  const Eigen::Vector3d across = direction.unitOrthogonal();
  line.covariance_m2 = 1e-4 * across * across.transpose();
  return line;
}

// Two worlds at 20 and -30 degrees: most lines follow the second, whose X the run has at -30.
OdometryRun TwoWings() {
  OdometryRun run = testing::MakeWallRun();
  run.manhattan_worlds.resize(2);
  run.manhattan_worlds[0].heading_rad = 20 * kDegree;
  run.manhattan_worlds[1].heading_rad = -30 * kDegree;
  run.lines = {
      LineAlong(0, LineAxis::kX, 0, Level(20), 3), LineAlong(1, LineAxis::kY, 0, Level(110), 2),
      LineAlong(2, LineAxis::kX, 1, Level(-30), 4), LineAlong(3, LineAxis::kY, 1, Level(60), 4),
      LineAlong(4, LineAxis::kVertical, -1, Eigen::Vector3d::UnitZ(), 50)};
  SlopedDirection slope;
  slope.azimuth_rad = 170 * kDegree;
  run.sloped_directions = {slope};
  return run;
}

// What a line's axis says of its direction, but for its sign.
double OffAxis(const RunLine& line, const OdometryRun& run) {
  const Eigen::Vector3d direction = (line.end_world - line.start_world).normalized();
  if (line.axis == LineAxis::kVertical) return direction.cross(Eigen::Vector3d::UnitZ()).norm();
  const double heading_rad = run.manhattan_worlds[static_cast<size_t>(line.world)].heading_rad;
  const double of_axis_rad = line.axis == LineAxis::kY ? M_PI / 2 : 0;
  return direction.cross(Level((heading_rad + of_axis_rad) / kDegree)).norm();
}

// How far a place is from where it was, turned by T.
double OffTurned(const RigidTransform& T, const Vector3d& turned, const Vector3d& was) {
  return (turned - T * was).norm();
}

TEST(BuildingWorld, TheMainHeadingBecomesXAndY) {
  OdometryRun run = TwoWings();
  const OdometryRun before = run;
  const RigidTransform T = TurnAlongBuilding(&run);
  EXPECT_NEAR(LogRotation(T.rotation).z(), 30 * kDegree, 1e-12);
  EXPECT_TRUE(T.translation.isZero());
  EXPECT_NEAR(run.manhattan_worlds[1].heading_rad, 0, 1e-12);
  // 50 degrees would be: X and Y of that world are interchanged.
  EXPECT_NEAR(run.manhattan_worlds[0].heading_rad, -40 * kDegree, 1e-12);
  EXPECT_EQ(run.lines[0].axis, LineAxis::kY);
  EXPECT_EQ(run.lines[1].axis, LineAxis::kX);
  EXPECT_EQ(run.lines[2].axis, LineAxis::kX);
  EXPECT_NEAR(run.sloped_directions[0].azimuth_rad, -160 * kDegree, 1e-12);
  for (size_t i = 0; i < run.lines.size(); ++i) {
    const RunLine& line = run.lines[i];
    EXPECT_LT(OffAxis(line, run), 1e-9) << line.id;
    EXPECT_LT(OffTurned(T, line.end_world, before.lines[i].end_world), 1e-12) << line.id;
    const Vector3d direction = (line.end_world - line.start_world).normalized();
    EXPECT_NEAR(direction.dot(line.covariance_m2 * direction), 0, 1e-12) << line.id;
    EXPECT_NEAR(line.covariance_m2.trace(), 1e-4, 1e-12) << line.id;
  }
  for (size_t i = 0; i < run.states.size(); ++i) {
    const OnlineState &turned = run.states[i], &was = before.states[i];
    EXPECT_LT(OffTurned(T, turned.T_world_imu.translation, was.T_world_imu.translation), 1e-12);
    EXPECT_LT((turned.velocity_world_m_s - T.rotation * was.velocity_world_m_s).norm(), 1e-12);
  }
  // What a keyframe sees is where it was, in its own frame.
  for (size_t i = 0; i < run.landmarks.size(); ++i) {
    EXPECT_LT((run.keyframes.back().T_world_imu.Inverse() * run.landmarks[i].p_world -
               before.keyframes.back().T_world_imu.Inverse() * before.landmarks[i].p_world)
                  .norm(),
              1e-9);
  }
}

TEST(BuildingWorld, IsThatOfAMap) {
  const OdometryRun run = TwoWings();
  MappingOptions options;
  options.adjustment.enabled = false;
  const MapResult map = BuildMap({.run = run, .sparse = true}, options);
  EXPECT_NEAR(LogRotation(map.source.T_world_run.rotation).z(), 30 * kDegree, 1e-12);
  EXPECT_TRUE(map.verdict.has_value());
  EXPECT_LT(OffTurned(map.source.T_world_run, map.keyframes.back().T_world_imu.translation,
                      run.keyframes.back().T_world_imu.translation),
            1e-12);
}

TEST(BuildingWorld, IsNotTurnedByAHeadingThatIsWithdrawnOrNotThere) {
  OdometryRun run = TwoWings();
  run.manhattan_worlds[1].withdrawn = true;
  EXPECT_NEAR(LogRotation(TurnAlongBuilding(&run).rotation).z(), -20 * kDegree, 1e-12);
  run.manhattan_worlds.clear();
  const Vector3d p = run.landmarks.front().p_world;
  EXPECT_TRUE(LogRotation(TurnAlongBuilding(&run).rotation).isZero());
  EXPECT_EQ(run.landmarks.front().p_world, p);
}

}  // namespace
}  // namespace slcmap
