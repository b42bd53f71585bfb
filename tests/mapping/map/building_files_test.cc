#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "mapping/map/building.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::ReadText;
using ::testing::SizeIs;
using testing::TempFolder;

// A wall with a door, the floor before it, the room over that, in a storey without a ceiling.
Building MakeBuilding() {
  Building building;
  building.storeys = {{0, -0.1, std::nullopt}};
  BuildingPlane wall;
  wall.kind = PlaneKind::kWall;
  wall.normal = {0.6, 0.8, 0};
  wall.offset_m = -1.23456;
  wall.sigma_m = 0.004;
  wall.outline_world = {{0, 0, 0}, {1, 0, 0}, {1, 0, 2}, {0, 0, 2}};
  wall.openings = {{OpeningKind::kDoor, true, 0.9, 2.05, wall.outline_world}};
  wall.room_ids = {0};
  wall.inferred = true;
  BuildingPlane floor;
  floor.id = 1;
  floor.kind = PlaneKind::kFloor;
  floor.normal = Vector3d::UnitZ();
  floor.outline_world = wall.outline_world;
  building.planes = {wall, floor};
  Room room;
  room.polygon = {{{0, 0}, {5, 0}, {5, 4}, {0, 4}}, {{{1, 1}, {1, 2}, {2, 2}}}};
  room.area_m2 = 19.5;
  room.height_m = 2.6;
  room.bounded = 0.75;
  building.rooms = {room};
  PlanWall plan;
  plan.start = {1, 2};
  plan.end = {3, 4};
  plan.thickness_m = 0.15;
  plan.thickness_assumed = true;
  plan.plane_ids = {0};
  plan.openings = {{OpeningKind::kDoor, true, 0.5, 1.4, 0, 2.05}};
  building.walls = {plan};
  building.T_map_world.rotation = Eigen::AngleAxisd(0.3, Vector3d::UnitZ());
  return building;
}

TEST(BuildingFiles, WhatIsWrittenIsReadBack) {
  const TempFolder folder, second;
  WriteBuilding(folder.Path(), MakeBuilding());
  const Building read = ReadBuilding(folder.Path());
  ASSERT_THAT(read.planes, SizeIs(2));
  EXPECT_NEAR((read.planes[0].normal - Vector3d(0.6, 0.8, 0)).norm(), 0, 1e-12);
  EXPECT_TRUE(read.planes[0].inferred && !read.planes[1].inferred);
  ASSERT_THAT(read.planes[0].openings, SizeIs(1));
  EXPECT_TRUE(read.planes[0].openings[0].walked);
  ASSERT_THAT(read.rooms, SizeIs(1));
  EXPECT_THAT(read.rooms[0].polygon.holes, SizeIs(1));
  ASSERT_THAT(read.walls, SizeIs(1));
  EXPECT_TRUE(read.walls[0].thickness_assumed);
  ASSERT_THAT(read.walls[0].openings, SizeIs(1));
  EXPECT_FALSE(read.storeys.at(0).ceiling_m);
  EXPECT_NEAR(Eigen::AngleAxisd(read.T_map_world.rotation).angle(), 0.3, 1e-9);
  WriteBuilding(second.Path(), read);
  for (const std::string& name : BuildingFiles()) {
    EXPECT_EQ(ReadText(folder.Path(name)), ReadText(second.Path(name))) << name;
  }
}

// The message about a building in whose file a text was replaced by another.
std::string MessageAfter(const std::string& name, const std::string& from, const std::string& to) {
  const TempFolder folder;
  WriteBuilding(folder.Path(), MakeBuilding());
  std::string text = ReadText(folder.Path(name));
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  folder.Write(name, text.replace(at, from.size(), to));
  return MessageOf<DataError>([&] { ReadBuilding(folder.Path()); });
}

TEST(BuildingFiles, DamageIsToldWithFileAndKey) {
  EXPECT_THAT(
      MessageAfter("planes.json", "\"wall\"", "\"roof\""),
      AllOf(HasSubstr("planes.json: plane 0: kind: found 'roof'"), HasSubstr("wall, floor")));
  EXPECT_THAT(MessageAfter("planes.json", "\"sigma_m\": 0.004", "\"sigma_m\": -1"),
              HasSubstr("sigma_m: found -1"));
  EXPECT_THAT(MessageAfter("planes.json", "0.8", "0.9"), HasSubstr("expected 1"));
  EXPECT_THAT(MessageAfter("planes.json", "\"offset_m\"", "\"offset\""),
              HasSubstr("offset_m: missing"));
  EXPECT_THAT(MessageAfter("rooms.json", "\"bounded\": 0.75", "\"bounded\": 1.5"),
              HasSubstr("rooms.json: room 0: bounded: found 1.5"));
  EXPECT_THAT(MessageAfter("plan.json", "\"version\": 1", "\"version\": 9"),
              HasSubstr("version 9"));
}

TEST(BuildingFiles, ReferencesToNothingAreRefused) {
  EXPECT_THAT(MessageAfter("rooms.json", "\"id\": 0", "\"id\": 3"),
              HasSubstr("expected ids to count from 0"));
  EXPECT_THAT(MessageAfter("planes.json", "\"storey\": 0", "\"storey\": 4"),
              HasSubstr("reference to storey 4"));
}

TEST(BuildingFiles, MissingFileIsNamed) {
  const TempFolder folder;
  EXPECT_THAT(MessageOf<DataError>([&] { ReadBuilding(folder.Path()); }), HasSubstr("planes.json"));
}

}  // namespace
}  // namespace slcmap
