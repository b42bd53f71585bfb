#include "mapping/surfaces/bounded_plane.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/mapping/planes/wall_with_door.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

double InsideArea(const BoundedPlane& plane) {
  return std::accumulate(plane.inside.begin(), plane.inside.end(), 0.0) * plane.grid.cell_m *
         plane.grid.cell_m;
}

TEST(BoundedPlanes, LeaveOutOpenings) {
  const std::vector<BoundedPlane> planes = BoundedPlanes(testing::WallWithDoor(0.004), {});
  ASSERT_EQ(planes.size(), 1);
  EXPECT_NEAR(InsideArea(planes[0]), 4 * 2.5 - 2, 0.1);
  EXPECT_EQ(planes[0].sigma_m, 0.004);
  EXPECT_EQ(planes[0].reach_m, PlaneOptions{}.reach_m);
  const PlaneGrid& grid = planes[0].grid;
  const Vector3d in_door(1.5, 3, 1), beside(3, 3, 1);
  EXPECT_FALSE(planes[0].inside(grid.FindRow(in_door), grid.FindColumn(in_door)));
  EXPECT_TRUE(planes[0].inside(grid.FindRow(beside), grid.FindColumn(beside)));
  EXPECT_LT((grid.At(0.5 + grid.FindColumn(beside), 0.5 + grid.FindRow(beside)) - beside).norm(),
            0.05);
}

// A room of 4 m x 4 m around a pillar.
Building RoomAroundPillar(double bounded) {
  Building building;
  Room room;
  room.id = 3;
  room.bounded = bounded;
  room.polygon.outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  room.polygon.holes = {{{1, 1}, {1, 3}, {3, 3}, {3, 1}}};
  building.rooms = {room};
  for (const bool is_floor : {true, false}) {
    BuildingPlane plane;
    plane.kind = is_floor ? PlaneKind::kFloor : PlaneKind::kCeiling;
    plane.normal = Vector3d(0, 0, is_floor ? 1 : -1);
    plane.offset_m = is_floor ? 0.2 : -2.7;
    plane.room_ids = {3};
    for (const auto& p : room.polygon.outline) {
      plane.outline_world.emplace_back(p.x(), p.y(), is_floor ? 0.2 : 2.7);
    }
    building.planes.push_back(plane);
  }
  return building;
}

TEST(BoundedPlanes, LeaveOutWhatRoomsRunAround) {
  const std::vector<BoundedPlane> planes = BoundedPlanes(RoomAroundPillar(0.9), {});
  ASSERT_EQ(planes.size(), 2);
  for (const BoundedPlane& plane : planes) {
    EXPECT_NEAR(InsideArea(plane), 16 - 4, 0.1);
    EXPECT_EQ(plane.reach_m, 4);
  }
  EXPECT_NEAR(planes[1].grid.At(3, 7).z(), 2.7, 1e-12);
}

// Where no walls say how far it goes, a floor is not filled far.
TEST(BoundedPlanes, ReachFarInRoomsThatWallsBound) {
  for (const BoundedPlane& plane : BoundedPlanes(RoomAroundPillar(0.4), {})) {
    EXPECT_EQ(plane.reach_m, PlaneOptions{}.reach_m);
  }
}

TEST(BoundedPlanes, AreNotMadeOfFurniture) {
  Building building = testing::WallWithDoor(0.004);
  building.planes[0].kind = PlaneKind::kOther;
  EXPECT_TRUE(BoundedPlanes(building, {}).empty());
}

}  // namespace
}  // namespace slcmap
