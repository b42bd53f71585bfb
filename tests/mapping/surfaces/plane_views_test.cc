#include "mapping/surfaces/plane_views.h"

#include <gtest/gtest.h>

#include "tests/mapping/surfaces/made_planes.h"

namespace slcmap {
namespace {

const double kBeside_m = PlaneOptions().beside_m;

void AddPatch(double from_x, double to_x, double z, uint8_t grey, std::vector<DensePoint>* cloud) {
  for (double x = from_x; x < to_x; x += 0.05) {
    for (double y = 1; y < 2; y += 0.05) {
      cloud->push_back({{x, y, z}, Eigen::Vector3d::UnitZ(), 0.01, grey});
    }
  }
}

TEST(MeasuredAround, TellsNothingBetweenTwoSurfaces) {
  std::vector<DensePoint> cloud;
  AddPatch(1, 2, 0, 90, &cloud);
  AddPatch(2.2, 3, 0.08, 90, &cloud);
  const PlaneGrid grid = testing::FloorGrid();
  const MeasuredAround around(grid, cloud, {}, kBeside_m);
  EXPECT_FALSE(around.At(20.9, 15));
  ASSERT_TRUE(around.At(18, 15));
  EXPECT_NEAR(around.At(18, 15)->offset_m, 0, 1e-9);
  ASSERT_TRUE(around.At(26, 15));
  EXPECT_NEAR(around.At(26, 15)->offset_m, 0.08, 1e-9);
}

TEST(MeasuredAround, PassesOverWhatFacesTheOtherWayOrIsFarOff) {
  std::vector<DensePoint> cloud;
  AddPatch(1, 2, 0.3, 90, &cloud);
  std::vector<DensePoint> turned;
  AddPatch(1, 2, 0, 90, &turned);
  for (DensePoint& point : turned) point.normal_world = -point.normal_world;
  cloud.insert(cloud.end(), turned.begin(), turned.end());
  const PlaneGrid grid = testing::FloorGrid();
  EXPECT_FALSE(MeasuredAround(grid, cloud, {}, kBeside_m).At(15, 15));
  EXPECT_FALSE(MeasuredAround(grid, {}, {}, kBeside_m).At(15, 15));
}

TEST(MeasuredAround, BlankPlaceIsOnThePlaneWhoseBorderIsSeen) {
  const PlaneGrid grid = testing::FloorGrid();
  const double middle_m = 0.5 * grid.columns * grid.cell_m, end_m = grid.rows * grid.cell_m;
  MapLine border, inner;
  border.start_world = grid.At(0, 0) + 0.002 * grid.normal;
  border.end_world = border.start_world + grid.columns * grid.cell_m * grid.u;
  inner.start_world = border.start_world + 0.4 * end_m * grid.v + 0.5 * grid.u;
  inner.end_world = border.end_world + 0.4 * end_m * grid.v - 0.5 * grid.u;
  const double column = middle_m / grid.cell_m, row = 0.5 * grid.rows;
  EXPECT_FALSE(MeasuredAround(grid, {}, {}, kBeside_m).OnPlane(column, row));
  const auto surface = MeasuredAround(grid, {}, {border, inner}, kBeside_m).OnPlane(column, row);
  ASSERT_TRUE(surface);
  EXPECT_EQ(surface->offset_m, 0);
  EXPECT_NEAR(surface->nearest_m, 0.5 * end_m, 0.03);  // not the inner one, 0.1 of it away
  EXPECT_FALSE(MeasuredAround(grid, {}, {inner}, kBeside_m).OnPlane(column, row));
  MapLine beyond = border;
  beyond.start_world -= grid.v;
  beyond.end_world -= grid.v;
  EXPECT_FALSE(MeasuredAround(grid, {}, {beyond}, kBeside_m).OnPlane(column, row));
}

TEST(MeasuredAround, BlankPlaceIsNotOnThePlaneBesideSomethingElseOrAPaneBehind) {
  const PlaneGrid grid = testing::FloorGrid();
  std::vector<DensePoint> wall, leaf, pane;
  AddPatch(1, 2, 0, 90, &wall);
  leaf = pane = wall;
  AddPatch(2.2, 2.3, -0.06, 90, &leaf);
  AddPatch(2.3, 2.6, -0.2, 90, &pane);
  const double column = 2.25 / grid.cell_m, row = 15;
  EXPECT_TRUE(MeasuredAround(grid, wall, {}, kBeside_m).OnPlane(column, row));
  EXPECT_FALSE(MeasuredAround(grid, leaf, {}, kBeside_m).OnPlane(column, row));
  EXPECT_FALSE(MeasuredAround(grid, pane, {}, kBeside_m).OnPlane(column, row));
  // Nearer to the wall than to the pane.
  EXPECT_TRUE(MeasuredAround(grid, pane, {}, kBeside_m).OnPlane(2.1 / grid.cell_m, row));
}

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

TEST(CountPasses, CountsRaysThatPassThePlaneForSure) {
  const std::tuple<const char*, Eigen::Vector3d, Eigen::Vector3f, float, int> rays[] = {
      {"ends behind", {0.5, 0, 0.5}, {0.5F, 4, 0.5F}, 0.01F, 1},
      {"from the other side", {0.5, 4, 0.5}, {0.5F, 1, 0.5F}, 0.01F, 1},
      {"ends at the plane", {0.5, 0, 0.5}, {0.5F, 2.05F, 0.5F}, 0.01F, 0},
      {"ends before it", {0.5, 0, 0.5}, {0.5F, 1, 0.5F}, 0.01F, 0},
      {"ends clearly behind", {0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.01F, 1},
      {"may end at the plane", {0.5, 0, 0.5}, {0.5F, 2.5F, 0.5F}, 0.2F, 0},
      {"goes beside", {3, 0, 0.5}, {3, 4, 0.5F}, 0.01F, 0}};
  for (const auto& [what, from, to, sigma_m, count] : rays) {
    EXPECT_EQ(Passes(from, to, sigma_m), count) << what;
  }
}

}  // namespace
}  // namespace slcmap
