#include "data/simulator/made_motion.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "data/core/error.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

class MadeMotionTest : public ::testing::TestWithParam<MotionKind> {
 protected:
  MadeMotionTest() {
    options_.kind = GetParam();
    options_.waypoints_m = {{1, 2, 1.5}, {7, 2, 1.5}, {7, 6, 1.5}, {1, 6, 1.5}, {1, 2, 1.5}};
  }
  RigidTransform CameraAt(const MotionSpline& motion, double t_s) const {
    return motion.PoseAt(t_s) * rig_.T_imu_camera[0];
  }

  const Rig rig_ = ExampleStereoRig();
  MadeMotionOptions options_;
};

TEST_P(MadeMotionTest, TheCameraLooksAlongTheWayWithTheWorldsUpAtItsTop) {
  const MotionSpline motion = MakeMotion(options_, rig_);
  // In the middle of the first side.
  const double t_s = options_.stand_still_s + options_.ease_s / 2 + 3.0 / options_.speed_m_s;
  const RigidTransform camera = CameraAt(motion, t_s);
  EXPECT_LT((camera.translation - Eigen::Vector3d(4, 2, 1.5)).norm(), 0.15);
  EXPECT_GT((camera.rotation * Eigen::Vector3d::UnitZ()).x(), 0.98);
  EXPECT_LT((camera.rotation * Eigen::Vector3d::UnitY()).z(), -0.98);
  EXPECT_NEAR(motion.VelocityAt(t_s).x(), options_.speed_m_s, 0.25);
}

TEST_P(MadeMotionTest, RestsAtItsStartAndReturnsToIt) {
  const MotionSpline motion = MakeMotion(options_, rig_);
  const double end_s = motion.Duration();
  for (const double t_s : {0.0, 0.5 * options_.stand_still_s, end_s - 0.5, end_s}) {
    EXPECT_LT((CameraAt(motion, t_s).translation - Eigen::Vector3d(1, 2, 1.5)).norm(), 1e-3);
    EXPECT_LT(motion.VelocityAt(t_s).norm(), 0.01);
    EXPECT_LT(motion.AngularVelocityAt(t_s).norm(), 0.02);
  }
  const RigidTransform change = motion.PoseAt(0).Inverse() * motion.PoseAt(end_s);
  EXPECT_LT(LogRotation(change.rotation).norm(), 3e-3);
}

TEST_P(MadeMotionTest, StaysWithinWhatTheKindCanDo) {
  const MotionSpline motion = MakeMotion(options_, rig_);
  double length_m = 0, most_m_s2 = 0, most_rad_s = 0;
  for (double t_s = 0; t_s < motion.Duration(); t_s += 0.01) {
    length_m += 0.01 * motion.VelocityAt(t_s).head<2>().norm();
    most_m_s2 = std::max(most_m_s2, motion.AccelerationAt(t_s).norm());
    most_rad_s = std::max(most_rad_s, motion.AngularVelocityAt(t_s).norm());
  }
  EXPECT_NEAR(length_m, 19.5, 1.0);  // corners are cut a little
  EXPECT_LT(most_m_s2, 6.0);
  EXPECT_GT(most_m_s2, 0.5);
  EXPECT_LT(most_rad_s, 2.5);
}

TEST_P(MadeMotionTest, TheSeedDecides) {
  const RigidTransform first = MakeMotion(options_, rig_).PoseAt(6.0);
  EXPECT_EQ(MakeMotion(options_, rig_).PoseAt(6.0).translation, first.translation);
  options_.seed = 2;
  EXPECT_NE(MakeMotion(options_, rig_).PoseAt(6.0).translation, first.translation);
}

INSTANTIATE_TEST_SUITE_P(Kinds, MadeMotionTest,
                         ::testing::Values(MotionKind::kWalk, MotionKind::kRobot,
                                           MotionKind::kFlight));

TEST(MadeMotionOptions, ReadsTheTrajectoryOfAScene) {
  MadeMotionOptions options;
  options.Read({YAML::Load("{kind: robot, speed_m_s: 0.7, waypoints_m: [[0, 0, 1], [3, 0, 1]]}"),
                "scene.yaml: trajectory"});
  EXPECT_EQ(options.kind, MotionKind::kRobot);
  EXPECT_EQ(options.speed_m_s, 0.7);
  ASSERT_EQ(options.waypoints_m.size(), 2u);
  EXPECT_EQ(options.waypoints_m[1], Eigen::Vector3d(3, 0, 1));
}

TEST(MadeMotionOptions, RefusesWhatCannotBeFollowed) {
  for (const char* text : {"{waypoints_m: [[0, 0, 1]]}", "{waypoints_m: [[0, 0], [3, 0]]}",
                           "{waypoints_m: [[0, 0, 1], [3, 0, 1], [1, 0, 1]]}",
                           "{kind: swim, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{speed_m_s: 0, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{speed_m_s: 1e-300, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{seed: -1, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{stand_still_s: 1e9, waypoints_m: [[0, 0, 1], [3, 0, 1]]}",
                           "{waypoints_m: [[0, 0, 1], [1e7, 0, 1]]}"}) {
    MadeMotionOptions options;
    EXPECT_THROW(options.Read({YAML::Load(text), "scene.yaml: trajectory"}), ConfigError) << text;
  }
}

TEST(MakeMotion, RefusesAWayOfDaysNamingItsLength) {
  MadeMotionOptions options;
  options.speed_m_s = 0.01;
  options.waypoints_m = {{0, 0, 1}, {900, 0, 1}};
  try {
    MakeMotion(options, ExampleStereoRig());
    FAIL() << "expected an error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("a way of 900 m that lasts 90006 s"),
              std::string::npos)
        << error.what();
  }
}

TEST(MakeMotion, CanBeEnded) {
  MadeMotionOptions options;
  options.waypoints_m = {{0, 0, 1}, {9, 0, 1}};
  EXPECT_THROW(MakeMotion(options, ExampleStereoRig(), Progress([](double) { return false; })),
               StoppedError);
}

TEST(EasedTime, StartsFromRestAndLosesHalfTheEase) {
  EXPECT_EQ(EasedTime(-1, 2), 0);
  EXPECT_NEAR(EasedTime(2, 2), 1, 1e-12);
  EXPECT_NEAR(EasedTime(5, 2), 4, 1e-12);
  EXPECT_LT(EasedTime(0.2, 2), 1e-3);
}

}  // namespace
}  // namespace slcmap
