#include <gtest/gtest.h>

#include "mapping/surfaces/plane_filling.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Whether a place of the plan is one of the plane's cells that may be filled.
bool Holds(const BoundedPlane& plane, double x, double y) {
  const Vector3d p(x, y, 0);
  const int column = plane.grid.FindColumn(p), row = plane.grid.FindRow(p);
  return plane.grid.Contains(column, row) && plane.inside(row, column) != 0;
}

// A storey with a room of 2 by 2 m, and rays from its middle through the door that it has to x = 6.
struct Scene {
  Building building;
  std::vector<ViewRays> rays;

  Scene() {
    building.storeys = {{0, 0.0, 2.5}};
    Room room;
    room.polygon.outline = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
    building.rooms = {room};
    ViewRays view;
    view.p_world_camera = {1, 1, 1.5};
    for (int i = -20; i <= 20; ++i) {
      view.p_world.emplace_back(6, 1 + 0.05F * static_cast<float>(i), 1.2F);
      view.sigma_m.push_back(0.02F);
    }
    rays.assign(5, view);
  }
};

TEST(StoreyPlanes, LieWhereRaysWentBeyondTheRooms) {
  const Scene scene;
  const std::vector<BoundedPlane> planes = StoreyPlanes(scene.building, scene.rays, {});
  ASSERT_EQ(planes.size(), 2u);
  for (const BoundedPlane& plane : planes) {
    EXPECT_TRUE(Holds(plane, 4, 1));
    EXPECT_TRUE(Holds(plane, 5.5, 1.5));
    EXPECT_FALSE(Holds(plane, 1, 1)) << "in the room";
    EXPECT_FALSE(Holds(plane, 2.2, 1)) << "in its wall";
    EXPECT_FALSE(Holds(plane, 4, 1.9)) << "no ray went there";
    EXPECT_FALSE(Holds(plane, 5.97, 1)) << "the rays' ends are something";
    EXPECT_FALSE(plane.is_measured);
    EXPECT_EQ(plane.reach_m, 1.5);
  }
  EXPECT_NEAR(planes[0].grid.At(0, 0).z(), 0, 1e-12);
  EXPECT_NEAR(planes[1].grid.At(0, 0).z(), 2.5, 1e-12);
  EXPECT_EQ(planes[1].grid.normal, Vector3d(-Vector3d::UnitZ()));
}

// A ceiling that nobody saw is nowhere; rays above and below a storey are not of it.
TEST(StoreyPlanes, AreOfWhatWasSeenOfAStorey) {
  Scene scene;
  scene.building.storeys[0].ceiling_m.reset();
  EXPECT_EQ(StoreyPlanes(scene.building, scene.rays, {}).size(), 1u);
  scene.building.storeys[0].floor_m = 3;
  EXPECT_TRUE(StoreyPlanes(scene.building, scene.rays, {}).empty());
  EXPECT_TRUE(StoreyPlanes(scene.building, {}, {}).empty());
}

}  // namespace
}  // namespace slcmap
