#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mapping/views/views_between.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

// 5 s of turning about all axes; images are stamped 30 ms late.
struct Turning {
  std::vector<OnlineState> states;
  std::vector<ImuSample> imu;

  explicit Turning(const Eigen::Quaterniond& R_given_world = Eigen::Quaterniond::Identity(),
                   const Eigen::Quaterniond& R_imu_given = Eigen::Quaterniond::Identity()) {
    for (int i = 0; i < 1000; ++i) {
      const double t_s = 0.005 * i;
      const Eigen::Quaterniond R(Eigen::AngleAxisd(1.5 * std::sin(t_s), Eigen::Vector3d::UnitX()) *
                                 Eigen::AngleAxisd(2 * t_s, Eigen::Vector3d::UnitY()));
      const int64_t stamp_ns = ToNanoseconds(t_s);
      imu.push_back(
          {stamp_ns, Eigen::Vector3d::Zero(), R.conjugate() * Eigen::Vector3d(0, 0, 9.81)});
      if (i % 10 > 0) continue;
      states.push_back({.stamp_ns = stamp_ns + ToNanoseconds(0.03),
                        .T_world_imu = {R_given_world * R * R_imu_given, {0, 0, 0}}});
    }
  }

  std::string Fault() const {
    const auto mean = MeanForceAt(states, imu, -0.03);
    return mean ? WhatIsNotUp(*mean) : "nothing to tell";
  }
};

TEST(UpOfPoses, IsZ) { EXPECT_EQ(Turning().Fault(), ""); }

TEST(UpOfPoses, AWorldWithYDownIsNoticed) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX()));
  EXPECT_THAT(Turning(turn).Fault(), HasSubstr("up is (0.00, 1.00, 0.00) in the world"));
}

TEST(UpOfPoses, PosesOfAnotherBodyAreNoticed) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  EXPECT_THAT(Turning(Eigen::Quaterniond::Identity(), turn).Fault(),
              HasSubstr("are the poses those of the IMU"));
}

TEST(UpOfPoses, FewSamplesSayNothing) {
  Turning turning;
  turning.imu.resize(100);
  EXPECT_EQ(turning.Fault(), "nothing to tell");
  Turning in_g;
  for (ImuSample& sample : in_g.imu) sample.specific_force_m_s2 /= 9.81;
  EXPECT_EQ(in_g.Fault(), "nothing to tell");
}

}  // namespace
}  // namespace slcmap
