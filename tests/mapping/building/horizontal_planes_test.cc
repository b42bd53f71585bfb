#include "mapping/building/horizontal_planes.h"

#include <gtest/gtest.h>

namespace slcmap {
namespace {

Room SquareRoom() {
  Room room;
  room.polygon.outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  room.area_m2 = 16;
  return room;
}

void AddLevel(double z_m, double facing, std::vector<SurfacePoint>* points) {
  for (double x = 0.1; x < 4; x += 0.1) {
    for (double y = 0.1; y < 4; y += 0.1) {
      points->push_back({{x, y, z_m}, {0, 0, facing}, 0.01});
    }
  }
}

TEST(HorizontalPlanes, AreWhereMostOfTheSurfaceIs) {
  std::vector<SurfacePoint> points;
  AddLevel(0.05, 1, &points);
  AddLevel(2.6, -1, &points);
  Room room = SquareRoom();
  std::vector<BuildingPlane> planes;
  AddFloorAndCeiling(points, {0, 2.5, 2.5, {}}, {}, &room, &planes);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_EQ(planes[0].kind, PlaneKind::kFloor);
  EXPECT_NEAR(planes[0].offset_m, 0.05, 1e-6);
  EXPECT_FALSE(planes[0].inferred);
  EXPECT_NEAR(room.height_m.value(), 2.55, 1e-6);
}

// A room has a floor even where it is too dark, or too far, to be measured.
TEST(HorizontalPlanes, AFloorThatWasNotSeenIsThatOfTheStorey) {
  Room room = SquareRoom();
  std::vector<BuildingPlane> planes;
  AddFloorAndCeiling({}, {-1.2, 1.3, 1.3, {}}, {}, &room, &planes);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].kind, PlaneKind::kFloor);
  EXPECT_TRUE(planes[0].inferred);
  EXPECT_EQ(planes[0].offset_m, -1.2);
  EXPECT_EQ(room.floor_m, -1.2);
  EXPECT_FALSE(room.height_m.has_value());
}

}  // namespace
}  // namespace slcmap
