#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/dense/depth_fusion.h"
#include "tests/mapping/dense/wall_depth.h"

namespace slcmap {
namespace {

constexpr double kDepth_m = 2, kSigma_m = 0.01;
constexpr int kStep_px = 5;

RigidTransform Beside(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0, 0}}; }

int64_t Known(const DepthGrid& grid) {
  return std::count_if(grid.nodes.begin(), grid.nodes.end(),
                       [](const DepthNode& node) { return node.is_known(); });
}

// How much of a wall is confirmed when other views stand at places and see it at depths.
double ConfirmedShare(const std::vector<std::pair<double, double>>& places_and_depths_m) {
  const DepthGrid wall = testing::WallAt(kDepth_m, kSigma_m, kStep_px);
  std::vector<DepthGrid> grids;
  for (const auto& [place_m, depth_m] : places_and_depths_m) {
    grids.push_back(testing::WallAt(depth_m, kSigma_m, kStep_px));
  }
  std::vector<PlacedGrid> others;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    others.push_back({Beside(places_and_depths_m[i].first), &grids[i]});
  }
  const DepthGrid confirmed =
      ConfirmedDepth({Beside(0), &wall}, others, testing::SmallCamera(), DenseOptions());
  return static_cast<double>(Known(confirmed)) / static_cast<double>(wall.nodes.size());
}

TEST(DepthConfirmation, TakesThreeViewsThatAgree) {
  EXPECT_GT(ConfirmedShare({{0.2, kDepth_m}, {-0.2, kDepth_m}}), 0.6);
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}}), 0);
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}, {-0.2, kDepth_m + 0.1}}), 0);
}

TEST(DepthConfirmation, CountsViewsFromOnePlaceAsOne) {
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}, {0.22, kDepth_m}, {0.25, kDepth_m}}), 0);
  EXPECT_EQ(ConfirmedShare({{0.02, kDepth_m}, {0.05, kDepth_m}, {-0.05, kDepth_m}}), 0);
}

TEST(DepthConfirmation, RefusesWhatMoreViewsSeeThroughThanAgreeWith) {
  const std::vector<std::pair<double, double>> agreeing = {{0.2, kDepth_m}, {-0.2, kDepth_m}};
  std::vector<std::pair<double, double>> opinions = agreeing;
  for (int i = 0; i < 4; ++i) opinions.emplace_back(0.05 * i, 3 * kDepth_m);
  EXPECT_EQ(ConfirmedShare(opinions), 0);
  opinions = agreeing;
  opinions.emplace_back(0.1, 3 * kDepth_m);  // one alone does not outvote them
  EXPECT_GT(ConfirmedShare(opinions), 0.6);
  opinions = agreeing;
  for (int i = 0; i < 4; ++i) opinions.emplace_back(0.05 * i, kDepth_m / 3);  // hidden from these
  EXPECT_GT(ConfirmedShare(opinions), 0.6);
}

}  // namespace
}  // namespace slcmap
