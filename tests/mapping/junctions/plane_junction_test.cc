#include <gtest/gtest.h>

#include "mapping/surfaces/junctions.h"
#include "tests/mapping/junctions/room_corner.h"

namespace slcmap {
namespace {

using testing::AddFloor;
using testing::AddWall;

std::optional<PlaneJunction> JunctionOf(const Building& building,
                                        const std::vector<DensePoint>& cloud) {
  const std::vector<SurfacePoints> surfaces = PointsOfPlanes(building, cloud, {});
  EXPECT_EQ(surfaces.size(), 2U);
  return FindJunction(surfaces[0], surfaces[1], {});
}

TEST(PlaneJunction, IsWhereBothSurfacesAreMeasured) {
  const Building building = testing::WallAndFloor();
  std::vector<DensePoint> cloud;
  AddWall({0, 3}, {0.1, 1}, 0, &cloud);
  AddFloor({1, 4}, {0.1, 1}, 0, &cloud);
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  EXPECT_NEAR(std::abs(junction->direction_world.x()), 1, 1e-12);
  double from_m = 1e9, to_m = -1e9;
  for (const JunctionPlace& place : junction->places) {
    const Eigen::Vector3d p = junction->At(place.along_m, place.offset_m);
    EXPECT_LT(std::hypot(p.y(), p.z()), 1e-9);
    from_m = std::min(from_m, p.x());
    to_m = std::max(to_m, p.x());
  }
  EXPECT_NEAR(from_m, 1, 0.15);
  EXPECT_NEAR(to_m, 3, 0.15);
}

TEST(PlaneJunction, EndsAtADoorway) {
  Building building = testing::WallAndFloor();
  PlaneOpening& door = building.planes[0].openings.emplace_back();
  door.outline_world = {{1, 0, 0}, {2, 0, 0}, {2, 0, 2.1}, {1, 0, 2.1}};
  std::vector<DensePoint> cloud;
  AddWall({0, 1.1}, {0.1, 1}, 0, &cloud);
  AddWall({1.9, 4}, {0.1, 1}, 0, &cloud);
  AddFloor({0, 4}, {0.1, 1}, 0, &cloud);
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  double nearest_m = 1e9;
  for (const JunctionPlace& place : junction->places) {
    const double x_m = junction->At(place.along_m, place.offset_m).x();
    EXPECT_FALSE(x_m > 1 && x_m < 2) << x_m;
    nearest_m = std::min(nearest_m, std::abs(x_m - 1));
  }
  EXPECT_LT(nearest_m, 0.06);
}

TEST(PlaneJunction, OfTwoWallsIsNoneOfADoorBesideIt) {
  Building building = testing::WallAndFloor();
  building.planes[1] = testing::MakePlane(PlaneKind::kWall, Eigen::Vector3d::UnitX(),
                                          {{0, 0, 0}, {0, 3, 0}, {0, 3, 2.5}, {0, 0, 2.5}});
  PlaneOpening& door = building.planes[0].openings.emplace_back();
  door.outline_world = {{0.05, 0, 0}, {1, 0, 0}, {1, 0, 2.1}, {0.05, 0, 2.1}};
  std::vector<DensePoint> cloud;
  AddWall({0, 0.05}, {0.1, 2}, 0, &cloud);
  for (double y_m = 0.05; y_m < 1; y_m += 0.04) {
    for (double z_m = 0.1; z_m < 2; z_m += 0.04) {
      cloud.push_back({{0, y_m, z_m}, Eigen::Vector3d::UnitX(), 0.005, 100});
    }
  }
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  EXPECT_GT(junction->places.size(), 30u);
}

TEST(PlaneJunction, FollowsSurfacesThatAreOffTheirPlanes) {
  const Building building = testing::WallAndFloor();
  std::vector<DensePoint> cloud;
  AddWall({0, 3}, {0.1, 1}, 0.012, &cloud);
  AddFloor({0, 3}, {0.1, 1}, -0.008, &cloud);
  const auto junction = JunctionOf(building, cloud);
  ASSERT_TRUE(junction);
  const JunctionPlace& place = junction->places[junction->places.size() / 2];
  const Eigen::Vector3d p = junction->At(place.along_m, place.offset_m);
  EXPECT_NEAR(p.y(), 0.012, 1e-9);
  EXPECT_NEAR(p.z(), -0.008, 1e-9);
}

TEST(PlaneJunction, IsNoneWhereOneIsFarFromTheOther) {
  const Building building = testing::WallAndFloor();
  std::vector<DensePoint> far, behind;
  AddWall({0, 3}, {0.7, 2}, 0, &far);  // a wall that may end above the floor
  AddFloor({0, 3}, {0.1, 1}, 0, &far);
  EXPECT_FALSE(JunctionOf(building, far));
  AddWall({0, 3}, {0.1, 1}, 0, &behind);
  AddFloor({0, 3}, {-1, -0.1}, 0, &behind);  // of another room
  EXPECT_FALSE(JunctionOf(building, behind));
}

TEST(PlaneJunction, IsNoneOfParallelPlanesAndWithoutPoints) {
  Building building = testing::WallAndFloor();
  EXPECT_FALSE(JunctionOf(building, {}));
  building.planes[1] = building.planes[0];
  std::vector<DensePoint> cloud;
  AddWall({0, 3}, {0.1, 1}, 0, &cloud);
  EXPECT_FALSE(JunctionOf(building, cloud));
}

}  // namespace
}  // namespace slcmap
