#include <gtest/gtest.h>

#include <cmath>

#include "mapping/map/refinement.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

using RunLine = decltype(OdometryRun::lines)::value_type;

constexpr double kDegree = M_PI / 180;

Eigen::Vector3d Level(double angle_deg) {
  return {std::cos(angle_deg * kDegree), std::sin(angle_deg * kDegree), 0};
}

RunLine LineAlong(int64_t id, LineAxis axis, int world, const Eigen::Vector3d& direction,
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
  for (const RunLine& line : run.lines) EXPECT_LT(OffAxis(line, run), 1e-9) << line.id;
}

TEST(BuildingWorld, EverythingIsTurnedAlike) {
  OdometryRun run = TwoWings();
  const OdometryRun before = run;
  const RigidTransform T = TurnAlongBuilding(&run);
  ASSERT_FALSE(run.states.empty() || run.keyframes.empty() || run.landmarks.empty());
  for (size_t i = 0; i < run.states.size(); ++i) {
    const OnlineState &turned = run.states[i], &was = before.states[i];
    EXPECT_LT((turned.T_world_imu.translation - T * was.T_world_imu.translation).norm(), 1e-12);
    EXPECT_LT((turned.T_world_imu.rotation.conjugate() * turned.velocity_world_m_s -
               was.T_world_imu.rotation.conjugate() * was.velocity_world_m_s)
                  .norm(),
              1e-12);
  }
  // What a keyframe sees is where it was, in its own frame.
  const Keyframe &turned = run.keyframes.back(), &was = before.keyframes.back();
  for (size_t i = 0; i < run.landmarks.size(); ++i) {
    EXPECT_LT((turned.T_world_imu.Inverse() * run.landmarks[i].p_world -
               was.T_world_imu.Inverse() * before.landmarks[i].p_world)
                  .norm(),
              1e-9);
  }
  for (const RunLine& line : run.lines) {
    const Eigen::Vector3d direction = (line.end_world - line.start_world).normalized();
    EXPECT_NEAR(direction.dot(line.covariance_m2 * direction), 0, 1e-12) << line.id;
    EXPECT_NEAR(line.covariance_m2.trace(), 1e-4, 1e-12) << line.id;
  }
}

TEST(BuildingWorld, IsThatOfAMap) {
  const OdometryRun run = TwoWings();
  MappingOptions options;
  options.adjustment.enabled = false;
  const MapResult map = BuildMap({.run = run, .sparse = true}, options);
  EXPECT_NEAR(LogRotation(map.source.T_world_run.rotation).z(), 30 * kDegree, 1e-12);
  EXPECT_TRUE(map.verdict.has_value());
  ASSERT_EQ(map.keyframes.size(), run.keyframes.size());
  EXPECT_LT((map.keyframes.back().T_world_imu.translation -
             map.source.T_world_run * run.keyframes.back().T_world_imu.translation)
                .norm(),
            1e-12);
}

TEST(BuildingWorld, AWithdrawnHeadingIsNone) {
  OdometryRun run = TwoWings();
  run.manhattan_worlds[1].withdrawn = true;
  EXPECT_NEAR(LogRotation(TurnAlongBuilding(&run).rotation).z(), -20 * kDegree, 1e-12);
}

TEST(BuildingWorld, WithoutAHeadingNothingIsTurned) {
  OdometryRun run = testing::MakeWallRun();
  run.manhattan_worlds.clear();
  const Eigen::Vector3d p = run.landmarks.front().p_world;
  EXPECT_TRUE(LogRotation(TurnAlongBuilding(&run).rotation).isZero());
  EXPECT_EQ(run.landmarks.front().p_world, p);
}

}  // namespace
}  // namespace slcmap
