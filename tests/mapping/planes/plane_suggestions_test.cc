// Planes by lines and points that were put where they should suggest them.
#include "mapping/planes/plane_suggestions.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "data/error.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kVoxel_m = 0.05;

// A floor of 4 x 4 m and a ceiling 3 m above it.
std::vector<DensePoint> FloorAndCeiling() {
  std::vector<DensePoint> points;
  for (double x = -2; x < 2; x += kVoxel_m) {
    for (double y = -2; y < 2; y += kVoxel_m) {
      points.push_back({{x, y, 0}, Vector3d::UnitZ(), 0.01, 100});
      points.push_back({{x, y, 3}, -Vector3d::UnitZ(), 0.01, 100});
    }
  }
  return points;
}

MapLine LevelLine(double y, double z, LineKind kind = LineKind::kEdge) {
  MapLine line;
  line.start_world = {-1.5, y, z};
  line.end_world = {1.5, y, z};
  line.kind = kind;
  return line;
}

// Those that face a way, at an offset.
int Count(const std::vector<SuggestedPlane>& planes, const Vector3d& normal, double offset_m) {
  return static_cast<int>(std::count_if(planes.begin(), planes.end(), [&](const auto& plane) {
    return plane.grid.normal.dot(normal) > 0.999 && std::abs(plane.grid.offset_m - offset_m) < 0.01;
  }));
}

TEST(SuggestPlanes, FollowFloorAndCeiling) {
  const auto planes = SuggestPlanes(FloorAndCeiling(), {}, kVoxel_m, {});
  EXPECT_EQ(planes.size(), 2u);
  EXPECT_EQ(Count(planes, Vector3d::UnitZ(), 0), 1);
  EXPECT_EQ(Count(planes, -Vector3d::UnitZ(), -3), 1);
}

TEST(SuggestPlanes, TakesLinesForUprightPlanesSeenFromEitherSide) {
  const auto planes =
      SuggestPlanes(FloorAndCeiling(), {LevelLine(2, 0.1), LevelLine(2.01, 2.9)}, kVoxel_m, {});
  EXPECT_EQ(planes.size(), 4u);
  EXPECT_EQ(Count(planes, -Vector3d::UnitY(), -2), 1);
  EXPECT_EQ(Count(planes, Vector3d::UnitY(), 2), 1);
}

TEST(SuggestPlanes, ReachFromFloorToCeiling) {
  const auto planes = SuggestPlanes(FloorAndCeiling(), {LevelLine(2, 0.1)}, kVoxel_m, {});
  for (const SuggestedPlane& plane : planes) {
    if (std::abs(plane.grid.normal.z()) > 0.5) continue;
    const int column = plane.grid.ColumnOf({0, 2, 0});
    ASSERT_TRUE(plane.grid.Contains(column, plane.grid.RowOf({0, 2, 2.9})));
    EXPECT_NE(plane.near(plane.grid.RowOf({0, 2, 2.9}), column), 0);
    EXPECT_FALSE(plane.grid.Contains(column, plane.grid.RowOf({0, 2, 3.2})));
    EXPECT_NEAR(plane.grid.DistanceTo({0, 2, 1}), 0, 1e-9);
    EXPECT_NEAR((plane.grid.At(3.5, 2.5) - plane.grid.At(2.5, 2.5)).norm(), plane.grid.cell_m,
                1e-9);
  }
}

TEST(SuggestPlanes, AreNotSuggestedByMarksSlopesAndShortLines) {
  MapLine sloped = LevelLine(2, 1);
  sloped.end_world.z() = 2;
  MapLine brief = LevelLine(2, 1);
  brief.end_world.x() = brief.start_world.x() + 0.3;
  const auto planes = SuggestPlanes(
      FloorAndCeiling(), {LevelLine(2, 1, LineKind::kMark), sloped, brief}, kVoxel_m, {});
  EXPECT_EQ(planes.size(), 2u);
}

TEST(SuggestPlanes, FollowAWallThatIsTurned) {
  const Vector3d normal(std::cos(0.4), std::sin(0.4), 0), along(-normal.y(), normal.x(), 0);
  std::vector<DensePoint> points = FloorAndCeiling();
  for (double s = -1; s < 1; s += kVoxel_m) {
    for (double z = 0.5; z < 2; z += kVoxel_m) {
      points.push_back({2 * normal + s * along + z * Vector3d::UnitZ(), -normal, 0.01, 100});
    }
  }
  const auto planes = SuggestPlanes(points, {}, kVoxel_m, {});
  EXPECT_EQ(Count(planes, -normal, -2), 1);
  EXPECT_EQ(Count(planes, normal, 2), 0);  // points have a side
}

TEST(SuggestPlanes, OfNothingAreNone) {
  EXPECT_TRUE(SuggestPlanes({}, {LevelLine(2, 1)}, kVoxel_m, {}).empty());
}

TEST(PlaneOptions, RefuseValuesOutOfTheirRange) {
  PlaneOptions options;
  options.patch_m = 0;
  EXPECT_THROW(options.Check(), ConfigError);
  options = PlaneOptions();
  options.min_images = options.max_images + 1;
  EXPECT_THROW(options.Check(), ConfigError);
}

}  // namespace
}  // namespace slcmap
