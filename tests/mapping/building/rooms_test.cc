#include "mapping/building/rooms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mapping/building/horizontal_planes.h"
#include "mapping/building/storeys.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using ::testing::SizeIs;

// Seen from the right of the way between two places.
WallFace Between(const Vector2d& a, const Vector2d& b) {
  WallFace wall;
  const Vector2d along = (b - a).normalized();
  wall.face.normal = {along.y(), -along.x()};
  wall.face.offset_m = wall.face.normal.dot(a);
  wall.face.from_m = wall.face.MeasureAlong(a);
  wall.face.to_m = wall.face.MeasureAlong(b);
  wall.shares.assign(static_cast<size_t>(std::lround((b - a).norm() / wall.step_m)), 1);
  return wall;
}

// Nothing is known of it there, in metres from its start.
void Uncover(double from_m, double to_m, WallFace* wall) {
  for (double along_m = from_m; along_m < to_m - 1e-6; along_m += wall->step_m) {
    wall->shares[static_cast<size_t>(std::lround(along_m / wall->step_m))] = 0;
  }
}

// A corridor of 10 by 2 m, and behind its wall of 15 cm two rooms with a wall between them.
class RoomsTest : public ::testing::Test {
 protected:
  RoomsTest() : free_(Eigen::AlignedBox2d(Vector2d(-1, -1), Vector2d(11, 7)), 0.05) {
    for (const auto& [low, high] : {std::pair(Vector2d(0, 0), Vector2d(10, 2)),
                                    std::pair(Vector2d(0, 2.15), Vector2d(4.9, 6)),
                                    std::pair(Vector2d(5.05, 2.15), Vector2d(10, 6))}) {
      for (double y = low.y() + 0.025; y < high.y(); y += 0.05) {
        for (int way = 0; way < 3; ++way) free_.AddWay({low.x(), y}, {high.x(), y});
      }
    }
  }

  std::vector<FoundRoom> Find(const std::vector<WallFace>& more = {}) const {
    std::vector<WallFace> walls = {corridor_,
                                   rooms_,
                                   Between({10, 0}, {0, 0}),
                                   Between({0, 6}, {10, 6}),
                                   Between({0, 0}, {0, 6}),
                                   Between({10, 6}, {10, 0}),
                                   Between({4.9, 6}, {4.9, 2.15}),
                                   Between({5.05, 2.15}, {5.05, 6})};
    walls.insert(walls.end(), more.begin(), more.end());
    return FindRooms(walls, free_, {});
  }

  FreeSpace free_;
  WallFace corridor_ = Between({0, 2}, {10, 2}), rooms_ = Between({10, 2.15}, {0, 2.15});
};

TEST_F(RoomsTest, ArePartedByAWallThatIsBlankOnOneSide) {
  Uncover(0.5, 4, &rooms_);  // from its start, at the right
  Uncover(6, 9.5, &rooms_);
  const std::vector<FoundRoom> found = Find();
  ASSERT_THAT(found, SizeIs(3));
  double area_m2 = 0;
  for (const FoundRoom& room : found) area_m2 += Area(room.polygon);
  EXPECT_NEAR(area_m2, 20 + 9.85 * 3.85, 0.1);
}

// Shelves hide both sides of it there.
TEST_F(RoomsTest, ArePartedWhereMoreThanADoorsWidthOfTheirWallWasNotSeen) {
  Uncover(1, 3.2, &corridor_);
  Uncover(6.8, 9, &rooms_);
  EXPECT_THAT(Find(), SizeIs(3));
}

TEST_F(RoomsTest, AreOneWhereRaysWentThroughAWideGap) {
  Uncover(0.5, 4.4, &corridor_);
  Uncover(5.6, 9.5, &rooms_);
  for (double x = 0.525; x < 4.4; x += 0.05) {
    for (int way = 0; way < 3; ++way) free_.AddWay({x, 1}, {x, 3});
  }
  EXPECT_THAT(Find(), SizeIs(2));
}

Room SquareRoom() {
  Room room;
  room.polygon.outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  room.area_m2 = 16;
  return room;
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

  std::optional<double> Height(double lamps_m, double bounded = 1) {
    for (double x = 0.1; x < lamps_m; x += 0.1) {
      for (double y = 0.1; y < 1.2; y += 0.1) {
        input_.points.push_back({{x, y, 2.44}, {0, 0, -1}, 0.01});
      }
    }
    Room room = SquareRoom();
    room.bounded = bounded;
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

TEST_F(DarkCeiling, AFewWallsTellItWhereNoOtherIsKnown) {
  AddLine({0.1, 0.01, 2.5}, {1.9, 0.01, 2.5});
  EXPECT_NEAR(Height(1.2, 0.25).value(), 2.5, 0.003);
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

// A blank ceiling, of which only the edges of walls and of a lamp are seen.
class BlankCeiling : public ::testing::Test {
 protected:
  BlankCeiling() {
    for (double x = 0; x < 4; x += 0.1) {
      input_.trajectory_world.emplace_back(x, 2, 1.5);
      for (double y = 0; y < 4; y += 0.1) input_.points.push_back({{x, y, 0}, {0, 0, 1}, 0.01});
      for (double z = 0; z < 2; z += 0.1) input_.points.push_back({{x, 0, z}, {0, 1, 0}, 0.01});
    }
  }

  void AddEdge(double z_m, double length_m) {
    MapLine line;
    line.start_world = {0, 0, z_m};
    line.end_world = {length_m, 0, z_m};
    line.kind = LineKind::kEdge;
    input_.lines.push_back(line);
  }

  std::optional<double> Ceiling() const { return FindLevels(input_).front().ceiling_m; }

  BuildingInput input_;
};

TEST_F(BlankCeiling, IsWhereTheHighestEdgesAre) {
  AddEdge(2.1, 4);  // of doors
  AddEdge(2.7, 3);
  AddEdge(2.71, 2);
  AddEdge(3.1, 0.5);  // too short to tell
  EXPECT_NEAR(Ceiling().value(), 2.704, 1e-9);
}

TEST_F(BlankCeiling, IsAboveTheLampsThatHangFromIt) {
  AddEdge(2.62, 4);
  AddEdge(2.7, 1.2);
  EXPECT_NEAR(Ceiling().value(), 2.7, 1e-9);
}

TEST_F(BlankCeiling, IsNotToldByFewEdgesNorBeneathWhatStandsHigher) {
  AddEdge(2.7, 3);
  EXPECT_FALSE(Ceiling().has_value());
  AddEdge(2.7, 3);
  EXPECT_TRUE(Ceiling().has_value());
  for (double z = 2.1; z < 4; z += 0.1) input_.points.push_back({{2, 0, z}, {0, 1, 0}, 0.01});
  EXPECT_FALSE(Ceiling().has_value());
}

}  // namespace
}  // namespace slcmap
