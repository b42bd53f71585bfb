#include "mapping/map/names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/made_building.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr char kAllNames[] =
    "buildings:\n  - {name: House A}\n"
    "storeys:\n  - {name: First floor, at: [1, 1, 4]}\n"
    "rooms:\n"
    "  - {name: \"K\\u00fcche \\\"1\\\"\", at: [2, 1.5, 1]}\n"
    "  - {name: Lab, id: 1}\n"
    "doors:\n  - {name: D-01, at: [2.55, 0, 1]}\n  - {name: W-07, wall: 2, opening: 0}\n";

class NamesTest : public ::testing::Test {
 protected:
  Names Read(const std::string& text) const { return ReadNames(temp_.Write("names.yaml", text)); }

  static MapResult MakeMap() {
    MapResult map;
    map.building = testing::MakeBuilding(2);
    return map;
  }

  testing::TempFolder temp_;
};

TEST_F(NamesTest, AreGivenByPlacesAndByIds) {
  MapResult map = MakeMap();
  EXPECT_EQ(ApplyNames(Read(kAllNames), &map), 0);
  EXPECT_EQ(map.building.name, "House A");
  EXPECT_EQ(map.building.storeys[0].name, "");
  EXPECT_EQ(map.building.storeys[1].name, "First floor");
  EXPECT_EQ(map.building.rooms[0].name, "K\u00fcche \"1\"");
  EXPECT_EQ(map.building.rooms[1].name, "Lab");
  EXPECT_EQ(map.building.walls[0].openings[0].name, "D-01");
  EXPECT_EQ(map.building.walls[2].openings[0].name, "W-07");
  EXPECT_EQ(GetTitle(map.building.rooms[1]), "Lab");
  EXPECT_EQ(GetTitle(map.building.storeys[0]), "Storey 0");
}

TEST_F(NamesTest, SurviveANewMapOfThePlace) {
  MapResult old = MakeMap();
  ApplyNames(Read(kAllNames), &old);
  // The new one has its rooms in another order, and its world elsewhere.
  constexpr double kTurn_rad = 0.7;
  MapResult map;
  map.building.storeys = {{0, 0, 2.5}, {1, 3, 5.5}};
  testing::AddRoom({0, 0}, {4, 3}, kTurn_rad, 1, &map.building);
  testing::AddRoom({0, 0}, {4, 3}, kTurn_rad, 0, &map.building);
  const RigidTransform T_new_old(ExpRotation({0, 0, kTurn_rad}), Eigen::Vector3d::Zero());
  Names names = {.of_world = true};
  AddNames(CollectNames(old.building), T_new_old, &names);
  EXPECT_EQ(ApplyNames(names, &map), 0);
  EXPECT_EQ(map.building.name, "House A");
  EXPECT_EQ(map.building.rooms[0].name, "Lab");
  EXPECT_EQ(map.building.rooms[1].name, "K\u00fcche \"1\"");
  EXPECT_EQ(map.building.storeys[1].name, "First floor");
  EXPECT_EQ(map.building.walls[4].openings[0].name, "D-01");
}

TEST_F(NamesTest, ThoseWithoutAPlaceAreCountedAndTheOthersStay) {
  MapResult map = MakeMap();
  const Names names = Read(
      "rooms:\n  - {name: Elsewhere, at: [20, 1, 1]}\n  - {name: Here, at: [1, 1, 1]}\n"
      "  - {name: Nobody, id: 7}\n  - {name: Second, at: [2, 1, 1]}\n"
      "doors:\n  - {name: Far, at: [2, 1.5, 1]}\n");
  EXPECT_EQ(ApplyNames(names, &map), 3);
  EXPECT_EQ(map.building.rooms[0].name, "Here");
}

TEST_F(NamesTest, PlacesAreInTheGridOfPosesAndInAReferenceSystem) {
  MapResult map = MakeMap();
  const auto name = [&](const std::string& of_room) {
    EXPECT_EQ(ApplyNames(Read(of_room), &map), 0);
    return map.building.rooms[0].name;
  };
  map.source.georeference = Georeference{.crs = "", .origin_m = {451200, 5411300, 312}};
  EXPECT_EQ(name("rooms:\n  - {name: A, at: [451202, 5411301, 313]}\n"), "A");
  map.source.georeference = Georeference{"EPSG:25832", {451000, 5411000, 300}, M_PI / 2, 0.9996};
  EXPECT_EQ(name("crs: EPSG:25832\nrooms:\n  - {name: B, at: [450999, 5411002, 301]}\n"), "B");
  EXPECT_EQ(name("rooms:\n  - {name: C, at: [2, 1, 1]}\n"), "C") << "in the map's world";
  EXPECT_THAT([&] { name("crs: EPSG:4978\nrooms:\n  - {name: D, at: [2, 1, 1]}\n"); },
              ThrowsMessage<ConfigError>(HasSubstr("found EPSG:4978, expected EPSG:25832")));
}

TEST_F(NamesTest, UnknownKeysAndEntriesWithoutAPlaceAreRefused) {
  const auto refuses = [&](const std::string& text, const std::string& words) {
    EXPECT_THAT([&] { Read(text); }, ThrowsMessage<ConfigError>(HasSubstr(words))) << text;
  };
  refuses("room:\n  - {name: A, id: 0}\n", "room");
  refuses("rooms:\n  - {name: A, id: 0, floor: 1}\n", "floor");
  refuses("rooms:\n  - {id: 0}\n", "rooms[0].name: found none");
  refuses("rooms:\n  - {name: \"B\xfcro\", id: 0}\n", "save the file as UTF-8");
  refuses("rooms:\n  - {name: A}\n", "found no place");
  refuses("rooms:\n  - {name: A, id: 0, at: [1, 2, 3]}\n", "found both");
  refuses("rooms:\n  - {name: A, at: [1, 2]}\n", "found 2 numbers, expected 3");
}

}  // namespace
}  // namespace slcmap
