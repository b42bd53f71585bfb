#include <gtest/gtest.h>

#include <limits>

#include "odometry/geometry/imu.h"

namespace slcmap {
namespace {

ImuSample Sample(int64_t stamp_ns, double x) {
  ImuSample s;
  s.stamp_ns = stamp_ns;
  s.angular_velocity_rad_s.x() = x;
  return s;
}

TEST(ImuBuffer, RefusesWhatIsNotLaterOrNotFinite) {
  ImuBuffer buffer;
  EXPECT_TRUE(buffer.Add(Sample(10, 1)));
  EXPECT_FALSE(buffer.Add(Sample(10, 1)));
  EXPECT_FALSE(buffer.Add(Sample(5, 1)));
  EXPECT_FALSE(buffer.Add(Sample(20, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(buffer.Add(Sample(20, 1e10)));  // no gyroscope measures this
  EXPECT_TRUE(buffer.Add(Sample(20, 1)));
}

TEST(ImuBuffer, InterpolatesTheEndsOfAnInterval) {
  ImuBuffer buffer;
  for (int i = 0; i <= 10; ++i) buffer.Add(Sample(10 * i, i));
  const auto between = buffer.Between(15, 42);
  ASSERT_EQ(between.size(), 5u);  // 15, 20, 30, 40, 42
  EXPECT_EQ(between.front().stamp_ns, 15);
  EXPECT_DOUBLE_EQ(between.front().angular_velocity_rad_s.x(), 1.5);
  EXPECT_EQ(between.back().stamp_ns, 42);
  EXPECT_DOUBLE_EQ(between.back().angular_velocity_rad_s.x(), 4.2);
  EXPECT_EQ(buffer.Between(20, 40).size(), 3u);
}

TEST(ImuBuffer, FindsTheLongestGap) {
  ImuBuffer buffer;
  for (const int64_t t_ms : {0, 5, 10, 110, 115}) buffer.Add(Sample(t_ms * 1000000, 0));
  EXPECT_NEAR(buffer.LongestGap(0, 115000000), 0.1, 1e-9);
  EXPECT_NEAR(buffer.LongestGap(0, 10000000), 0.005, 1e-9);
  EXPECT_NEAR(buffer.LongestGap(50000000, 60000000), 0.1, 1e-9);  // lies inside the gap
}

TEST(ImuBuffer, KeepsWhatTheNextIntervalNeeds) {
  ImuBuffer buffer;
  for (int i = 0; i <= 10; ++i) buffer.Add(Sample(10 * i, i));
  buffer.DropBefore(55);
  EXPECT_DOUBLE_EQ(buffer.Between(55, 60).front().angular_velocity_rad_s.x(), 5.5);
}

}  // namespace
}  // namespace slcmap
