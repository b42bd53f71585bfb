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
  AddFloorAndCeiling({points, {}, {}, {}}, {0, 2.5, 2.5, {}}, &room, &planes);
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
  AddFloorAndCeiling(BuildingInput(), {-1.2, 1.3, 1.3, {}}, &room, &planes);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].kind, PlaneKind::kFloor);
  EXPECT_TRUE(planes[0].inferred);
  EXPECT_EQ(planes[0].offset_m, -1.2);
  EXPECT_EQ(room.floor_m, -1.2);
  EXPECT_FALSE(room.height_m.has_value());
}

// Of a dark ceiling only the lamps beneath it are seen, and where it meets the walls.
class DarkCeiling : public ::testing::Test {
 protected:
  void AddLine(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    MapLine line;
    line.start_world = a;
    line.end_world = b;
    input_.lines.push_back(line);
  }

  std::optional<double> Height(double lamps_m) {
    for (double x = 0.1; x < lamps_m; x += 0.1) {
      for (double y = 0.1; y < 1.2; y += 0.1) {
        input_.points.push_back({{x, y, 2.44}, {0, 0, -1}, 0.01});
      }
    }
    Room room = SquareRoom();
    std::vector<BuildingPlane> planes;
    AddFloorAndCeiling(input_, {0, 2.44, 2.44, {}}, &room, &planes);
    return room.height_m;
  }

  BuildingInput input_;
};

TEST_F(DarkCeiling, IsAtTheTopOfItsWalls) {
  AddLine({0.1, 0.01, 2.5}, {3.9, 0.01, 2.5});
  AddLine({3.99, 3.8, 2.505}, {3.99, 0.1, 2.505});
  AddLine({1, 2, 2.6}, {3, 2, 2.6});  // in the middle of the room
  EXPECT_NEAR(Height(1.2).value(), 2.5025, 0.003);
}

TEST_F(DarkCeiling, OfWhichNothingIsSeenIsThereWhereItsStoreyHasOne) {
  EXPECT_FALSE(Height(0).has_value());
  AddLine({0.1, 0.01, 2.1}, {3.9, 0.01, 2.1});  // of cupboards
  AddLine({3.99, 3.8, 2.1}, {3.99, 0.1, 2.1});
  EXPECT_FALSE(Height(0).has_value());
  AddLine({0.1, 0.01, 2.5}, {3.9, 0.01, 2.5});
  AddLine({3.99, 3.8, 2.5}, {3.99, 0.1, 2.5});
  EXPECT_NEAR(Height(0).value(), 2.5, 0.003);
}

TEST_F(DarkCeiling, ASingleLineTellsLittle) {
  AddLine({0.1, 0.01, 2.5}, {1.9, 0.01, 2.5});
  EXPECT_NEAR(Height(1.2).value(), 2.44, 0.003);
}

TEST_F(DarkCeiling, LinesBesideEachOtherCountOnce) {
  for (int i = 0; i < 4; ++i) AddLine({0.1, 0.01 * i, 2.5}, {1.9, 0.01 * i, 2.5});  // a cornice
  EXPECT_NEAR(Height(1.2).value(), 2.44, 0.003);
}

TEST_F(DarkCeiling, IsNotTheFloorOfTheStoreyAboveNorWhatHangsLower) {
  for (const double z : {2.46, 2.52, 2.74}) {  // rails, the ceiling, a floor
    AddLine({0.1, 0.01, z}, {3.9, 0.01, z});
    AddLine({3.99, 3.8, z}, {3.99, 0.1, z});
  }
  EXPECT_NEAR(Height(1.2).value(), 2.52, 0.003);
}

TEST_F(DarkCeiling, WhatIsSeenOfMostOfItCounts) {
  AddLine({0.1, 0.01, 2.5}, {3.9, 0.01, 2.5});
  AddLine({3.99, 3.8, 2.5}, {3.99, 0.1, 2.5});
  for (double y = 1.2; y < 4; y += 0.1) {
    for (double x = 0.1; x < 4; x += 0.1) input_.points.push_back({{x, y, 2.44}, {0, 0, -1}, 0.01});
  }
  EXPECT_NEAR(Height(4).value(), 2.44, 0.003);
}

}  // namespace
}  // namespace slcmap
