#include <gtest/gtest.h>

#include "export/scene/scene.h"

namespace slcmap {
namespace {

Trajectory Poses(int count, int64_t step_ns) {
  Trajectory poses(count);
  for (int i = 0; i < count; ++i) poses[i].stamp_ns = i * step_ns;
  return poses;
}

TEST(TrajectoryGap, IsAsGivenWherePosesAreDense) {
  EXPECT_EQ(TrajectoryGap_s(Poses(40, 50'000'000), 0.5), 0.5);
}

TEST(TrajectoryGap, IsLongerWherePosesAreRare) {
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(Poses(40, 1'000'000'000), 0.5), 4);
}

TEST(TrajectoryGap, OneLongGapIsStillOne) {
  Trajectory poses = Poses(40, 1'000'000'000);
  poses.back().stamp_ns += 60'000'000'000;
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(poses, 0.5), 4);
}

TEST(TrajectoryGap, NeedsNoPoses) {
  EXPECT_EQ(TrajectoryGap_s({}, 0.5), 0.5);
  EXPECT_EQ(TrajectoryGap_s(Poses(1, 1), 0.5), 0.5);
}

}  // namespace
}  // namespace slcmap
