// Space in front of a wall, at it and behind it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "mapping/dense/dense_map.h"
#include "tests/mapping/dense/wall_depth.h"

namespace slcmap {
namespace {

constexpr double kWallDepth_m = 2.02, kCell_m = 0.05, kSpacing_m = 0.04;
constexpr int kNodeStep_px = 2;

OccupancyOptions OccupancyTestOptions() {
  OccupancyOptions options;
  options.resolution_m = kCell_m;
  options.max_range_m = 4;
  return options;
}

Eigen::Vector3d Ahead(double z_m) { return {0.1, 0.1, z_m}; }

TEST(DepthOccupancy, CarvesToThreeSigmasBeforeAWall) {
  constexpr double kSigma_m = 0.1;
  DepthOccupancy occupancy(OccupancyTestOptions());
  occupancy.Add({}, testing::SmallCamera(), testing::WallAt(kWallDepth_m, kSigma_m, kNodeStep_px));
  const OccupancyMap map = occupancy.Finish({}, kSpacing_m);
  for (double z_m = 0.3; z_m < kWallDepth_m - 3 * kSigma_m - kCell_m; z_m += 0.02) {
    EXPECT_TRUE(map.IsFree(Ahead(z_m))) << z_m;
  }
  for (double z_m = kWallDepth_m - 3 * kSigma_m + 2 * kCell_m; z_m < kWallDepth_m + 1;
       z_m += 0.02) {
    EXPECT_FALSE(map.IsFree(Ahead(z_m))) << z_m;
  }
  EXPECT_TRUE(map.IsOccupied(Ahead(kWallDepth_m)));
  EXPECT_FALSE(map.IsOccupied(Ahead(kWallDepth_m + 0.2)));
}

TEST(DepthOccupancy, SaysNothingWhereDepthIsUnknown) {
  DepthGrid half = testing::WallAt(kWallDepth_m, 0.01, kNodeStep_px);
  for (int row = 0; row < half.rows; ++row) {
    for (int column = 0; column < half.columns / 2; ++column) half.At(column, row) = {};
  }
  DepthOccupancy occupancy(OccupancyTestOptions());
  occupancy.Add({}, testing::SmallCamera(), half);
  const OccupancyMap map = occupancy.Finish({}, kSpacing_m);
  EXPECT_TRUE(map.IsFree({0.5, 0, 1.5}));
  EXPECT_FALSE(map.IsFree({-0.5, 0, 1.5}));
  EXPECT_FALSE(map.IsOccupied({-0.5, 0, kWallDepth_m}));
}

TEST(DepthOccupancy, FollowsNoRayBeyondItsRange) {
  DepthOccupancy occupancy(OccupancyTestOptions());
  occupancy.Add({}, testing::SmallCamera(), testing::WallAt(9, 0.01, kNodeStep_px));
  const OccupancyMap map = occupancy.Finish({}, kSpacing_m);
  EXPECT_TRUE(map.IsFree(Ahead(3.5)));
  EXPECT_FALSE(map.IsFree(Ahead(4.3)));
  EXPECT_FALSE(map.IsOccupied(Ahead(9)));
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
  DepthOccupancy occupancy(OccupancyTestOptions());
  for (int i = 0; i < 30; ++i)
    occupancy.Add({}, testing::SmallCamera(), testing::WallAt(kWallDepth_m, 0.01, kNodeStep_px));
  DensePoint point;
  point.p_world = Ahead(1);
  point.normal_world = -Eigen::Vector3d::UnitZ();
  const OccupancyMap map = occupancy.Finish({point}, kSpacing_m);
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
