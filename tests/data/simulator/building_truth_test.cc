#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "data/core/error.h"
#include "data/simulator/truth.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::SizeIs;
using testing::TempFolder;

// Two rooms of 5 by 4 m less a wall of 0.15 m between them, with an open door and a window.
Scene TwoRooms(double inexact) {
  const TempFolder folder;
  const std::string path = folder.Write("scene.yaml", R"(
objects:
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, doors: [[0, 1, 1, 2.1, 90]], windows: [[0, 2.5, 1, 1.2, 0.9]]}
  - {kind: slab, at: [0, 0, 0], size: [10, 4]}
  - {kind: slab, at: [0, 0, 2.7], size: [10, 4], faces_down: true}
)");
  InexactOptions options;
  options.amount = inexact;
  return ReadScene(path, {}, options);
}

TEST(BuildingTruth, WallsHaveBothFacesAndTheirOpenings) {
  const std::vector<TrueWall> walls = TrueWalls(TwoRooms(0));
  ASSERT_THAT(walls, SizeIs(6));
  // The front of the wall between the rooms is to the left of its way, at x = 5.
  const TrueWall &front = walls[4], &back = walls[5];
  EXPECT_NEAR(front.normal.x(), -1, 1e-9);
  EXPECT_NEAR(front.offset_m, -5, 1e-6);
  EXPECT_NEAR(back.normal.x(), 1, 1e-9);
  EXPECT_NEAR(back.offset_m, 5.15, 1e-6);
  ASSERT_THAT(front.openings, SizeIs(2));
  EXPECT_TRUE(front.openings[0].is_open);
  EXPECT_TRUE(front.openings[0].is_door);
  EXPECT_NEAR(front.openings[0].clear_width_m, 0.96, 1e-9);
  EXPECT_FALSE(front.openings[1].is_open);
  EXPECT_EQ(front.openings[0].id, back.openings[0].id);
}

TEST(BuildingTruth, RoomsAreBetweenTheFacesOfWalls) {
  const std::vector<TrueRoom> rooms = TrueRooms(TwoRooms(0));
  ASSERT_THAT(rooms, SizeIs(2));
  EXPECT_NEAR(rooms[0].area_m2, 20, 0.01);
  EXPECT_NEAR(rooms[1].area_m2, 4.85 * 4, 0.01);
  EXPECT_NEAR(rooms[0].height_m, 2.7, 1e-6);
}

TEST(BuildingTruth, InexactWallsAreTheirPlanesOfLeastSquares) {
  const std::vector<TrueWall> exact = TrueWalls(TwoRooms(0)), bent = TrueWalls(TwoRooms(1));
  ASSERT_EQ(exact.size(), bent.size());
  double farthest_m = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    EXPECT_GT(exact[i].normal.dot(bent[i].normal), 0.9999);
    const double off_m = std::abs(exact[i].offset_m - bent[i].offset_m);
    EXPECT_LT(off_m, 0.05);
    farthest_m = std::max(farthest_m, off_m);
  }
  EXPECT_GT(farthest_m, 0.002);
}

TEST(BuildingTruth, OnlyWhatWasSeenCounts) {
  const Scene scene = TwoRooms(0);
  // The room with x < 5, except its floor; nobody looked through its door.
  const auto is_seen = [](const Vector3d& p) { return p.x() < 4.999; };
  const TrueBuilding building = ObserveBuilding(scene, is_seen, {{1, 1, 1.5}});
  EXPECT_NEAR(building.walls[3].seen_m2, 4 * 2.7, 0.2);  // at x = 0
  EXPECT_EQ(building.walls[1].seen_m2, 0);               // at x = 10
  EXPECT_EQ(building.walls[4].openings[0].looked_through, 0);
  EXPECT_TRUE(building.rooms[0].is_entered);
  EXPECT_FALSE(building.rooms[1].is_entered);
}

TEST(BuildingTruth, FileIsReadBackAndDamageIsNamed) {
  const TempFolder folder;
  const TrueBuilding building =
      ObserveBuilding(TwoRooms(1), [](const Vector3d&) { return true; }, {});
  const std::string path = folder.Path("building.json");
  WriteTrueBuilding(path, building);
  const TrueBuilding read = ReadTrueBuilding(path);
  ASSERT_EQ(read.walls.size(), building.walls.size());
  EXPECT_NEAR(read.walls[4].offset_m, building.walls[4].offset_m, 1e-5);
  EXPECT_EQ(read.walls[4].seen_world.size(), building.walls[4].seen_world.size());
  EXPECT_EQ(read.walls[4].openings[0].is_open, true);
  ASSERT_THAT(read.rooms, SizeIs(2));
  EXPECT_NEAR(read.rooms[1].area_m2, building.rooms[1].area_m2, 1e-5);
  folder.Write("building.json", R"({"format": "slcmap true building", "version": 1})");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadTrueBuilding(path); }), HasSubstr("cell_m: missing"));
}

}  // namespace
}  // namespace slcmap
