// A room of known walls, from its images: what is mapped lies on them, and covers them.
#include "mapping/dense/dense_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "data/core/error.h"
#include "tests/mapping/dense/wall_depth.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

DenseOptions SmallOptions() {
  DenseOptions options;
  options.grid_px = 4;
  options.min_travel_m = 0.05;
  return options;
}

TEST(DenseMap, LiesOnTheWallsOfARoomOfWhichAViewIsLost) {
  RoomViews room(3, 0.25, 1.5);
  room.Lose(5);
  const DenseMap map = BuildDense(room.views(), room, SmallOptions());
  EXPECT_EQ(map.views_without_images, 1);
  ASSERT_GT(map.points.size(), 2500u);
  int64_t near = 0, inward = 0;
  for (const DensePoint& point : map.points) {
    near += room.DistanceFromWalls_m(point.p_world) < 0.05;
    EXPECT_NEAR(point.normal_world.norm(), 1, 1e-9);
    inward += point.normal_world.dot(room.room().center() - point.p_world) > 0;
  }
  const auto count = static_cast<double>(map.points.size());
  EXPECT_GT(static_cast<double>(near), 0.97 * count);
  EXPECT_GT(static_cast<double>(inward), 0.999 * count);  // in corners a patch may see two walls
  const DenseMap none =
      BuildDense(room.views(), room, SmallOptions(), Progress([](double) { return false; }));
  EXPECT_TRUE(none.points.empty());
  EXPECT_EQ(none.views, 0);
}

TEST(DenseOptions, RefusesValuesOutOfTheirRange) {
  DenseOptions options;
  options.voxel_m = 0;
  EXPECT_THROW(options.Check(), ConfigError);
  options = DenseOptions();
  options.min_depth_m = 5;
  options.max_depth_m = 2;
  EXPECT_THROW(options.Check(), ConfigError);
}

// Space in front of a wall, at it and behind it.

constexpr double kWallDepth_m = 2.02, kCell_m = 0.05, kSpacing_m = 0.04;
constexpr int kNodeStep_px = 2;

OccupancyOptions OccupancyTestOptions() {
  OccupancyOptions options;
  options.resolution_m = kCell_m;
  options.max_range_m = 4;
  return options;
}

Eigen::Vector3d Ahead(double z_m) { return {0.1, 0.1, z_m}; }

// Of a grid of depths that some views have, with some points.
OccupancyMap Carve(const DepthGrid& grid, int views = 1,
                   const std::vector<DensePoint>& points = {}) {
  DepthOccupancy occupancy(OccupancyTestOptions());
  for (int i = 0; i < views; ++i) occupancy.Add({}, testing::SmallCamera(), grid);
  return occupancy.Finish(points, kSpacing_m);
}

TEST(DepthOccupancy, CarvesToThreeSigmasBeforeAWall) {
  constexpr double kFarSigma_m = 0.1;
  const OccupancyMap map = Carve(testing::WallAt(kWallDepth_m, kFarSigma_m, kNodeStep_px));
  for (double z_m = 0.3; z_m < kWallDepth_m - 3 * kFarSigma_m - kCell_m; z_m += 0.02) {
    EXPECT_TRUE(map.IsFree(Ahead(z_m))) << z_m;
  }
  for (double z_m = kWallDepth_m - 3 * kFarSigma_m + 2 * kCell_m; z_m < kWallDepth_m + 1;
       z_m += 0.02) {
    EXPECT_FALSE(map.IsFree(Ahead(z_m))) << z_m;
  }
  EXPECT_TRUE(map.IsOccupied(Ahead(kWallDepth_m)));
  EXPECT_FALSE(map.IsOccupied(Ahead(kWallDepth_m + 0.2)));
}

TEST(DepthOccupancy, SaysNothingWhereDepthIsUnknownOrBeyondItsRange) {
  DepthGrid half = testing::WallAt(kWallDepth_m, 0.01, kNodeStep_px);
  for (int row = 0; row < half.rows; ++row) {
    for (int column = 0; column < half.columns / 2; ++column) half.At(column, row) = {};
  }
  const OccupancyMap map = Carve(half);
  EXPECT_TRUE(map.IsFree({0.5, 0, 1.5}));
  EXPECT_FALSE(map.IsFree({-0.5, 0, 1.5}));
  EXPECT_FALSE(map.IsOccupied({-0.5, 0, kWallDepth_m}));
  const OccupancyMap far = Carve(testing::WallAt(9, 0.01, kNodeStep_px));
  EXPECT_TRUE(far.IsFree(Ahead(3.5)));
  EXPECT_FALSE(far.IsFree(Ahead(4.3)));
  EXPECT_FALSE(far.IsOccupied(Ahead(9)));
}

TEST(DepthOccupancy, CountsACellOnceAView) {
  const DepthCarver carver(kCell_m, 4);
  const CellObservation observation =
      carver.Observe({}, testing::SmallCamera(), testing::WallAt(kWallDepth_m, 0.01, kNodeStep_px));
  const auto less = [](const OctreeCell& a, const OctreeCell& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::vector<OctreeCell> cells = observation.free;
  cells.insert(cells.end(), observation.occupied.begin(), observation.occupied.end());
  std::sort(cells.begin(), cells.end(), less);
  EXPECT_EQ(std::adjacent_find(cells.begin(), cells.end()), cells.end());
  EXPECT_GT(observation.occupied.size(), 1000u);
}

TEST(DepthOccupancy, MakesFusedSurfacesOccupied) {
  const OccupancyMap map = Carve(testing::WallAt(kWallDepth_m, 0.01, kNodeStep_px), 30,
                                 {{Ahead(1), -Eigen::Vector3d::UnitZ(), 0, 0}});
  EXPECT_TRUE(map.IsOccupied(Ahead(1)));
  EXPECT_TRUE(map.IsFree(Ahead(0.9)));
}

// Points that are farther apart than cells are wide, on a slope, so that some cells have none.
TEST(MarkSurfaces, LeavesNoHolesBetweenPoints) {
  constexpr double kApart_m = 0.04, kSmall_m = 0.025;
  const Eigen::Vector3d across = Eigen::Vector3d(1, 0, 0.5).normalized(), up(0, 1, 0);
  std::vector<DensePoint> points;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      DensePoint point;
      point.p_world = kApart_m * (i * across + j * up);
      point.normal_world = across.cross(up);
      points.push_back(point);
    }
  }
  OccupancyMap map(kSmall_m);
  MarkSurfaces(points, kApart_m, &map);
  map.Finish();
  int places = 0, occupied = 0;
  for (double along_m = 0.1; along_m < 0.6; along_m += 0.01) {
    for (double up_m = 0.1; up_m < 0.6; up_m += 0.01) {
      const Eigen::Vector3d p = along_m * across + up_m * up;
      ++places;
      occupied += map.IsOccupied(p);
      EXPECT_FALSE(map.IsOccupied(p + 3 * kSmall_m * points[0].normal_world));
    }
  }
  EXPECT_GT(occupied, 0.99 * places);
  EXPECT_FALSE(map.IsOccupied(-(kApart_m + kSmall_m) * across));
}

TEST(DepthOccupancy, RefusesCellsThatWouldTakeTooMuchMemory) {
  OccupancyOptions options;
  options.resolution_m = 0.001;
  options.max_range_m = 20;
  EXPECT_THROW(DepthOccupancy{options}, ConfigError);
}

}  // namespace
}  // namespace slcmap
