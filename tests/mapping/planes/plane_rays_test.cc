#include <gtest/gtest.h>

#include "mapping/surfaces/plane_views.h"

namespace slcmap {
namespace {

// The plane y = 2, 1 m square, seen from y = 0.
PlaneGrid WallGrid() {
  PlaneGrid grid;
  grid.normal = -Eigen::Vector3d::UnitY();
  grid.u = Eigen::Vector3d::UnitX();
  grid.v = Eigen::Vector3d::UnitZ();
  grid.offset_m = -2;
  grid.cell_m = 0.1;
  grid.columns = grid.rows = 10;
  return grid;
}

int Passes(const Eigen::Vector3d& from, const Eigen::Vector3f& to, float sigma_m) {
  const cv::Mat1i passes = CountPasses(WallGrid(), {{from, {to}, {sigma_m}}});
  int sum = 0;
  for (const int count : passes) sum += count;
  return sum;
}

TEST(CountPasses, CountsRaysThatEndBehind) {
  const cv::Mat1i passes =
      CountPasses(WallGrid(), {{{0.25, 0, 0.55}, {{0.25F, 4, 0.55F}}, {0.01F}}});
  EXPECT_EQ(passes(5, 2), 1);
}

TEST(CountPasses, CountsRaysFromEitherSide) {
  EXPECT_EQ(Passes({0.5, 4, 0.5}, {0.5F, 1, 0.5F}, 0.01F), 1);
}

TEST(CountPasses, LeavesOutWhatEndsAtThePlane) {
  EXPECT_EQ(Passes({0.5, 0, 0.5}, {0.5F, 2.05F, 0.5F}, 0.01F), 0);
  EXPECT_EQ(Passes({0.5, 0, 0.5}, {0.5F, 1, 0.5F}, 0.01F), 0);
}

TEST(CountPasses, LeavesOutWhatMayEndAtThePlane) {
  EXPECT_EQ(Passes({0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.01F), 1);
  EXPECT_EQ(Passes({0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.2F), 0);
}

TEST(CountPasses, LeavesOutWhatGoesBeside) {
  EXPECT_EQ(Passes({3, 0, 0.5}, {3, 4, 0.5F}, 0.01F), 0);
}

}  // namespace
}  // namespace slcmap
