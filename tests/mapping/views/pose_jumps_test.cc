#include <gtest/gtest.h>

#include <cmath>

#include "mapping/views/views_between.h"

namespace slcmap {
namespace {

// Ten seconds of a walk in a circle that speeds up, and turns quickly to and fro.
Trajectory Walk(double rate_hz) {
  Trajectory trajectory;
  for (int i = 0; i <= 10 * rate_hz; ++i) {
    const double t_s = i / rate_hz, angle = 0.03 * t_s * t_s;
    const Eigen::Vector3d p(3 * std::cos(angle), 3 * std::sin(angle), 0.05 * std::sin(10 * t_s));
    const Eigen::Vector3d turn(0.1 * std::sin(12 * t_s), 0, angle + 0.3 * std::sin(4 * t_s));
    trajectory.push_back({ToNanoseconds(t_s), {ExpRotation(turn), p}});
  }
  return trajectory;
}

void MoveFrom(size_t first, const RigidTransform& T, Trajectory* trajectory) {
  for (size_t i = first; i < trajectory->size(); ++i) {
    (*trajectory)[i].T_world_imu = T * (*trajectory)[i].T_world_imu;
  }
}

TEST(PoseJumps, MotionIsNone) {
  for (const double rate_hz : {200.0, 20.0, 10.0, 3.0}) {
    EXPECT_TRUE(FindJumps(Walk(rate_hz)).empty()) << rate_hz;
  }
}

TEST(PoseJumps, ASideStepIsOne) {
  for (const double rate_hz : {200.0, 20.0}) {
    Trajectory trajectory = Walk(rate_hz);
    const size_t at = trajectory.size() / 2;
    MoveFrom(at, {Eigen::Quaterniond::Identity(), {0, 0, 0.3}}, &trajectory);
    const std::vector<PoseJump> jumps = FindJumps(trajectory);
    ASSERT_EQ(jumps.size(), 1u) << rate_hz;
    EXPECT_EQ(jumps[0].stamp_ns, trajectory[at].stamp_ns);
    EXPECT_NEAR(jumps[0].moved_m, 0.3, 0.03);
  }
}

TEST(PoseJumps, ATurnOnTheSpotIsOne) {
  Trajectory trajectory = Walk(20);
  const RigidTransform& here = trajectory[90].T_world_imu;
  const RigidTransform turn{ExpRotation({0, 0, 0.4}), Eigen::Vector3d::Zero()};
  MoveFrom(90, here * turn * here.Inverse(), &trajectory);
  const std::vector<PoseJump> jumps = FindJumps(trajectory);
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_NEAR(jumps[0].turned_rad, 0.4, 0.05);
}

TEST(PoseJumps, AStrayPoseIsTwo) {
  Trajectory trajectory = Walk(20);
  trajectory[40].T_world_imu.translation.x() += 1;
  EXPECT_EQ(FindJumps(trajectory).size(), 2u);
}

// Between poses that are far apart in time anything may have happened.
TEST(PoseJumps, GapsTellNothing) {
  Trajectory trajectory = Walk(20);
  trajectory.erase(trajectory.begin() + 50, trajectory.begin() + 80);
  MoveFrom(50, {Eigen::Quaterniond::Identity(), {5, 0, 0}}, &trajectory);
  EXPECT_TRUE(FindJumps(trajectory).empty());
}

}  // namespace
}  // namespace slcmap
