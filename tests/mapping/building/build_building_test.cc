#include "mapping/building/build_building.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "apps/evaluation/map_metrics.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::PlacesAlong;
using testing::Scan;
using testing::ScanOptions;
using testing::SceneFromText;
using testing::SeenFrom;
using ::testing::SizeIs;

std::vector<BuildingPlane> MakeWalls(const Building& building) {
  std::vector<BuildingPlane> walls = building.planes;
  std::erase_if(walls, [](const BuildingPlane& plane) { return plane.kind != PlaneKind::kWall; });
  return walls;
}

std::vector<PlaneOpening> OpeningsOf(const Building& building) {
  std::vector<PlaneOpening> openings;
  for (const BuildingPlane& plane : building.planes) {
    openings.insert(openings.end(), plane.openings.begin(), plane.openings.end());
  }
  return openings;
}

// Of the planes of walls with that heading (of the normal, degrees, to half a degree).
std::vector<double> OffsetsAlong(const Building& building, double heading_deg) {
  std::vector<double> offsets;
  for (const BuildingPlane& plane : MakeWalls(building)) {
    const double turn_deg =
        std::atan2(plane.normal.y(), plane.normal.x()) * 180 / M_PI - heading_deg;
    if (std::abs(std::remainder(turn_deg, 360)) < 0.5) offsets.push_back(plane.offset_m);
  }
  std::sort(offsets.begin(), offsets.end());
  return offsets;
}

// Of a scene of these objects, seen from places along some ways.
Building BuildFrom(const std::string& objects, const std::vector<std::vector<Vector3d>>& ways,
                   const ScanOptions& options = {}, const std::string& before = "") {
  std::vector<Vector3d> places;
  for (const std::vector<Vector3d>& way : ways) {
    const std::vector<Vector3d> along = PlacesAlong(way);
    places.insert(places.end(), along.begin(), along.end());
  }
  return BuildBuilding(Scan(SceneFromText(before + "objects:\n" + objects), places, options), {});
}

// A room of 5 by 4 m, 2.7 m high, with more in it.
std::string RoomWith(const std::string& objects) {
  return R"(
materials:
  blank: {texture: plain, contrast: 0}
objects:
  - {kind: wall, points: [[0, 0], [5, 0], [5, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: slab, at: [0, 0, 0], size: [5, 4], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [5, 4], material: ceiling, faces_down: true}
)" + objects;
}

std::vector<Vector3d> InRoom() { return PlacesAlong({{1, 1, 1.5}, {4, 1.2, 1.5}, {4, 3, 1.5}}); }

TEST(BuildBuilding, RoomHasFourWallsItsAreaAndItsHeight) {
  const BuildingInput input = Scan(SceneFromText(RoomWith("")), InRoom());
  const Building building = BuildBuilding(input, {}), again = BuildBuilding(input, {});
  ASSERT_THAT(building.storeys, SizeIs(1));
  EXPECT_NEAR(building.storeys[0].floor_m, 0, 0.01);
  EXPECT_NEAR(building.storeys[0].ceiling_m.value(), 2.7, 0.01);
  EXPECT_THAT(MakeWalls(building), SizeIs(4));
  ASSERT_THAT(building.rooms, SizeIs(1));
  EXPECT_NEAR(building.rooms[0].area_m2, 20, 0.2);
  EXPECT_NEAR(building.rooms[0].height_m.value(), 2.7, 0.015);
  EXPECT_EQ(building.storeys[0].floor_m, building.rooms[0].floor_m);
  for (const BuildingPlane& plane : MakeWalls(building)) {
    EXPECT_THAT(plane.room_ids, ElementsAre(0));
    EXPECT_THAT(plane.openings, IsEmpty());
  }
  ASSERT_THAT(building.walls, SizeIs(4));
  EXPECT_TRUE(building.walls[0].thickness_assumed);
  for (const auto& [heading_deg, offset_m] :
       {std::pair(0, 0), std::pair(90, 0), std::pair(180, -5), std::pair(270, -4)}) {
    EXPECT_THAT(OffsetsAlong(building, heading_deg), ElementsAre(DoubleNear(offset_m, 0.01)))
        << heading_deg;
  }
  ASSERT_EQ(again.planes.size(), building.planes.size());
  for (size_t i = 0; i < building.planes.size(); ++i) {
    EXPECT_EQ(again.planes[i].offset_m, building.planes[i].offset_m) << "the same each time";
  }
}

TEST(BuildBuilding, NothingGivesNothing) {
  const Building building = BuildBuilding({}, {});
  EXPECT_THAT(building.storeys, IsEmpty());
  EXPECT_THAT(building.planes, IsEmpty());
  BuildingInput only_trajectory;
  only_trajectory.trajectory_world = InRoom();
  EXPECT_THAT(BuildBuilding(only_trajectory, {}).rooms, IsEmpty());
}

TEST(BuildBuilding, WhatStandsInARoomIsNoWallAndNoOpening) {
  struct Row {
    const char *what, *objects;
    bool hides_no_wall;
    Vector3d drift_m = Vector3d::Zero();
  };
  for (const Row& row :
       {Row{"blank and furnished walls", R"(
  - {kind: box, at: [2.5, 0.01, 0], size: [4.96, 0.01, 2.69], material: blank}
  - {kind: shelf, at: [0.01, 3.2, 0], yaw_deg: 90, seed: 3, repeat: 3, step: [0, -0.95, 0]}
  - {kind: cabinet, at: [2.2, 3.99, 0], repeat: 2, step: [1.0, 0, 0]}
)",
            false},
        Row{"a duct and the leaf of a door", R"(
  - {kind: box, at: [2.5, 0.05, 2.4], size: [4.9, 0.08, 0.12], material: white}
  - {kind: box, at: [4.5, 2, 0], size: [0.9, 0.04, 2.1]}
)",
            true},
        Row{"a wall that is measured again, 3 cm off", "", true, {0.03, 0.03, 0}}}) {
    SCOPED_TRACE(row.what);
    ScanOptions options;
    options.drift_m = row.drift_m;
    options.with_lines = row.drift_m.isZero();
    std::vector<Vector3d> places = InRoom(), back = places;
    if (!row.drift_m.isZero()) places.insert(places.end(), back.rbegin(), back.rend());
    const Building building =
        BuildBuilding(Scan(SceneFromText(RoomWith(row.objects)), places, options), {});
    EXPECT_THAT(OpeningsOf(building), IsEmpty());
    if (row.hides_no_wall) EXPECT_THAT(MakeWalls(building), SizeIs(4));
    ASSERT_THAT(building.rooms, SizeIs(1));
    EXPECT_NEAR(building.rooms[0].area_m2, 20, 0.4);
  }
}

TEST(BuildBuilding, PiersEndAtTheNichesBetweenThem) {
  const Scene scene = SceneFromText(RoomWith(R"(
  - {kind: box, at: [0.9, 0.15, 0], size: [0.8, 0.3, 2.7], repeat: 3, step: [1.6, 0, 0]}
)"));
  const Building building = BuildBuilding(Scan(scene, InRoom()), {});
  int piers = 0;
  for (const BuildingPlane& plane : MakeWalls(building)) {
    EXPECT_THAT(plane.openings, IsEmpty());
    if (plane.normal.y() < 0.99 || std::abs(plane.offset_m - 0.3) > 0.02) continue;
    ++piers;
    EXPECT_NEAR((plane.outline_world[1] - plane.outline_world[0]).norm(), 0.8, 0.15);
  }
  EXPECT_EQ(piers, 3);
}

// As the jamb of a door in the wall across stands in its plane.
TEST(BuildBuilding, AWallEndsWhereHardlyAnythingStandsBeyondAPassage) {
  for (const double stub_m : {0.2, 1.2}) {
    const std::string y = std::to_string(4 - stub_m / 2), length = std::to_string(stub_m);
    const Building building = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: slab, at: [0, 0, 0], size: [10, 4], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [10, 4], material: ceiling, faces_down: true}
  - {kind: box, at: [5, 0.9, 0], size: [0.2, 1.8, 2.7]}
  - {kind: box, at: [5, )" + y + ", 0], size: [0.2, " +
                                            length + ", 2.7]}\n",
                                        {{{1, 1, 1.5}, {2, 2.3, 1.5}, {8, 2.3, 1.5}, {9, 1, 1.5}}});
    const auto passages = OpeningsOf(building);
    EXPECT_EQ(passages.empty(), stub_m < 0.5) << stub_m;
    for (const PlaneOpening& opening : passages) EXPECT_EQ(opening.kind, OpeningKind::kPassage);
  }
}

// Two rooms beside each other, with a wall between them that has what is given. The second is
// walked into, or is where another run was.
enum class Second { kUnseen, kWalkedInto, kOfAnotherRun };
Building TwoRooms(const std::string& openings, Second second) {
  std::vector<std::vector<Vector3d>> ways = {{{1, 2.8, 1.5}, {3.8, 3, 1.5}, {4, 1.5, 1.5}}};
  if (second == Second::kWalkedInto) {
    ways[0].insert(ways[0].end(), {{4.6, 1.5, 1.5}, {5.6, 1.5, 1.5}});
  }
  if (second != Second::kUnseen) ways.push_back({{6.2, 1.5, 1.5}, {9, 1.5, 1.5}, {8, 3, 1.5}});
  ScanOptions options;
  options.rays = 8000;
  return BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: slab, at: [0, 0, 0], size: [10, 4], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [10, 4], material: ceiling, faces_down: true}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, skirting_height: 0.09, )" +
                       openings + "}\n",
                   ways, options);
}

TEST(BuildBuilding, OpenDoorIsSeenThroughAndPartsRooms) {
  const Building building = TwoRooms("doors: [[0, 1.0, 1.0, 2.1, 90]]", Second::kWalkedInto);
  EXPECT_THAT(building.rooms, SizeIs(2));
  const std::vector<PlaneOpening> openings = OpeningsOf(building);
  ASSERT_THAT(openings, SizeIs(2));  // one on each face
  for (const PlaneOpening& opening : openings) {
    EXPECT_EQ(opening.kind, OpeningKind::kDoor);
    EXPECT_TRUE(opening.walked);
    EXPECT_NEAR(opening.clear_width_m, 0.96, 0.02);
    EXPECT_NEAR(opening.clear_height_m, 2.08, 0.06);
  }
  int pairs = 0;
  for (const PlanWall& wall : building.walls) {
    if (wall.thickness_assumed) continue;
    ++pairs;
    EXPECT_NEAR(wall.thickness_m, 0.15, 0.015);
    EXPECT_THAT(wall.openings, SizeIs(1));
    EXPECT_THAT(wall.plane_ids, SizeIs(2));
  }
  EXPECT_EQ(pairs, 1);
}

TEST(BuildBuilding, DoorWhoseTopNobodySawIsAsHighAsDoorsAre) {
  ScanOptions options;
  options.rays = 8000;
  BuildingInput input = Scan(SceneFromText(R"(
objects:
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true, skirting_height: 0.09}
  - {kind: slab, at: [0, 0, 0], size: [10, 4], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [10, 4], material: ceiling, faces_down: true}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, doors: [[0, 1.0, 1.0, 2.1, 90]]}
)"),
                             PlacesAlong({{1, 2.8, 1.3},
                                          {3.8, 3, 1.3},
                                          {4, 1.5, 1.3},
                                          {6.2, 1.5, 1.3},
                                          {9, 1.5, 1.3},
                                          {8, 3, 1.3}}),
                             options);
  // Of a camera that looks down, but for the ceiling.
  constexpr double kHighest_m = 1.4;
  std::erase_if(input.points, [](const SurfacePoint& point) {
    return point.p_world.z() > kHighest_m && point.normal_world.z() > -0.7;
  });
  std::erase_if(input.lines, [](const MapLine& line) {
    return std::max(line.start_world.z(), line.end_world.z()) > kHighest_m;
  });
  for (ViewRays& view : input.rays) {
    std::erase_if(view.p_world, [](const auto& p) { return p.z() > kHighest_m; });
    view.sigma_m.resize(view.p_world.size(), 0.01F);
  }
  const Building building = BuildBuilding(input, {});
  EXPECT_THAT(building.rooms, SizeIs(2));
  const std::vector<PlaneOpening> openings = OpeningsOf(building);
  ASSERT_THAT(openings, SizeIs(2));
  for (const PlaneOpening& opening : openings) {
    EXPECT_EQ(opening.kind, OpeningKind::kDoor);
    EXPECT_NEAR(opening.clear_height_m, 2.1, 0.02);
  }
}

// Two rooms behind a corridor; of the wall between them the right one looked at one side alone.
TEST(BuildBuilding, BackOfAWallThatNobodySawIsToldWhereARoomEndsThere) {
  const Scene scene = SceneFromText(R"(
objects:
  - {kind: wall, points: [[0, 0], [12, 0], [12, 6], [0, 6]], closed: true, skirting_height: 0.09}
  - {kind: slab, at: [0, 0, 0], size: [12, 6], material: carpet}
  - {kind: slab, at: [0, 0, 2.7], size: [12, 6], material: ceiling, faces_down: true}
  - {kind: wall, points: [[0, 2], [12, 2]], has_back: true,
     doors: [[0, 2.5, 1.0, 2.1, 90], [0, 8.5, 1.0, 2.1, 90]]}
  - {kind: wall, points: [[6, 2.15], [6, 6]], has_back: true}
)");
  BuildingInput input = Scan(scene, PlacesAlong({{1, 1, 1.5},
                                                 {3, 1, 1.5},
                                                 {3, 4, 1.5},
                                                 {1.5, 4, 1.5},
                                                 {3, 4, 1.5},
                                                 {3, 1, 1.5},
                                                 {9, 1, 1.5},
                                                 {9, 4, 1.5},
                                                 {10.5, 4, 1.5},
                                                 {9, 4, 1.5},
                                                 {9, 1, 1.5},
                                                 {11, 1, 1.5}}));
  std::erase_if(input.points, [](const SurfacePoint& point) {
    return point.normal_world.x() > 0.7 && std::abs(point.p_world.x() - 6) < 0.3;
  });
  std::erase_if(input.lines, [](const MapLine& line) {
    return line.start_world.x() > 6.02 && line.start_world.x() < 6.5 && line.end_world.x() < 6.5;
  });
  const Building building = BuildBuilding(input, {});
  EXPECT_THAT(building.rooms, SizeIs(3));
  ASSERT_EQ(std::ranges::count(building.planes, true, &BuildingPlane::inferred), 1);
  const BuildingPlane& inferred =
      *std::ranges::find(building.planes, true, &BuildingPlane::inferred);
  EXPECT_EQ(inferred.kind, PlaneKind::kWall);
  EXPECT_GT(inferred.normal.x(), 0.99);
  // The wall is 0.15 m thick, behind the face at 6 m that looks to the left.
  EXPECT_NEAR(inferred.offset_m, 6.15, 0.03);
  EXPECT_THAT(inferred.room_ids, SizeIs(1));
  EXPECT_GE(inferred.sigma_m, 0.02);
  const auto wall = std::ranges::find_if(building.walls, [&](const PlanWall& of) {
    return std::ranges::count(of.plane_ids, inferred.id) > 0;
  });
  ASSERT_NE(wall, building.walls.end());
  EXPECT_TRUE(wall->thickness_assumed);
  EXPECT_FALSE(building.planes[wall->plane_ids[0]].inferred);
}

TEST(BuildBuilding, CeilingIsAboveTheLampsThatHideMostOfIt) {
  const Scene scene = SceneFromText(RoomWith(R"(
  - {kind: slab, at: [0.4, 0.4, 2.6], size: [4.2, 3.2], faces_down: true}
)"));
  const Building building = BuildBuilding(Scan(scene, InRoom()), {});
  ASSERT_THAT(building.storeys, SizeIs(1));
  EXPECT_NEAR(building.storeys[0].ceiling_m.value(), 2.7, 0.01);
  ASSERT_THAT(building.rooms, SizeIs(1));
  EXPECT_NEAR(building.rooms[0].height_m.value(), 2.7, 0.015);
}

TEST(BuildBuilding, FromOneRunToTheNextNobodyWalked) {
  const Building building = TwoRooms("doors: [[0, 1.0, 1.0, 2.1, 90]]", Second::kOfAnotherRun);
  const std::vector<PlaneOpening> openings = OpeningsOf(building);
  ASSERT_THAT(openings, SizeIs(2));
  for (const PlaneOpening& opening : openings) EXPECT_FALSE(opening.walked);
}

TEST(BuildBuilding, ClosedDoorAndPaneAreNoOpenings) {
  const Building building = TwoRooms(
      "doors: [[0, 1.0, 1.0, 2.1, 0]], windows: [[0, 2.5, 1.0, 1.2, 0.9]]", Second::kUnseen);
  EXPECT_THAT(OpeningsOf(building), IsEmpty());
  EXPECT_THAT(building.rooms, SizeIs(1));
}

TEST(BuildBuilding, PaneOfClearGlassIsOneWindowThoughBarsDivideIt) {
  const Building building = TwoRooms(
      "doors: [[0, 0.6, 1.0, 2.1, 90]], clear_glass: true, windows: [[0, 2.0, 1.6, 1.6, 0.5]]",
      Second::kWalkedInto);
  EXPECT_THAT(building.rooms, SizeIs(2));
  int windows = 0;
  for (const PlaneOpening& opening : OpeningsOf(building)) {
    if (opening.kind != OpeningKind::kWindow) continue;
    ++windows;
    EXPECT_NEAR(opening.clear_width_m, 1.56, 0.03);
    EXPECT_NEAR(opening.clear_height_m, 1.56, 0.06);
  }
  EXPECT_EQ(windows, 2);  // one on each face
}

TEST(BuildBuilding, WallsOfOtherHeadingsAreNotStraightened) {
  const Building wing = BuildFrom(R"(
  - {kind: wall, points: [[8.0, 1], [0, 1], [0, -1], [8.2, -1]]}
  - {kind: wall, wing: 1, points: [[0, -1], [8, -1], [8, 1], [0, 1]]}
  - {kind: slab, at: [0, -1, 0], size: [9, 2]}
  - {kind: slab, wing: 1, at: [0, -1, -0.002], size: [8, 2]}
)",
                                  {{{1, 0, 1.5}, {8, 0, 1.5}, {15, 1.5, 1.5}}}, {},
                                  "wings: [[0, 0, 0], [12, 8, 0]]\n");
  for (const double heading_deg : {90, 270, 102, 282}) {
    EXPECT_THAT(OffsetsAlong(wing, heading_deg), SizeIs(1)) << heading_deg;
  }
  const Building askew = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [8, 0], [8, 4.419], [0, 4]], closed: true}
  - {kind: slab, at: [0, 0, 0], size: [8, 5]}
)",
                                   {{{1, 2, 1.5}, {7, 2, 1.5}}});
  EXPECT_THAT(OffsetsAlong(askew, 90), SizeIs(1));
  EXPECT_THAT(OffsetsAlong(askew, 270), IsEmpty());
  EXPECT_THAT(OffsetsAlong(askew, 273), SizeIs(1));
}

// The wall at y = 4 steps back by 6 cm; a wall of 6 cm has faces both ways.
TEST(BuildBuilding, WallsSixCentimetresApartStayTwo) {
  const Building building = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [8, 0], [8, 4.06], [4, 4.06], [4, 4], [0, 4]], closed: true}
  - {kind: wall, points: [[4, 0], [4, 2]], has_back: true, thickness: 0.06}
  - {kind: slab, at: [0, 0, 0], size: [8, 5]}
)",
                                      {{{1, 1, 1.5}, {3, 3, 1.5}, {7, 3, 1.5}, {7, 1, 1.5}}});
  EXPECT_THAT(OffsetsAlong(building, 270),
              ElementsAre(DoubleNear(-4.06, 0.01), DoubleNear(-4, 0.01)));
  EXPECT_TRUE(std::ranges::any_of(building.walls, [](const PlanWall& wall) {
    return !wall.thickness_assumed && std::abs(wall.thickness_m - 0.06) < 0.015;
  }));
}

// The lower storey is 8 by 4 m; the upper one 4 by 4 m, without a ceiling.
TEST(BuildBuilding, StoreysOfUnequalAreaAndACeilingNeverSeen) {
  const Building building =
      BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [8, 0], [8, 4], [0, 4]], closed: true, height: 2.6}
  - {kind: wall, points: [[0, 0], [4, 0], [4, 4], [0, 4]], closed: true, at: [0, 0, 3]}
  - {kind: slab, at: [0, 0, 0], size: [8, 4]}
  - {kind: slab, at: [0, 0, 2.6], size: [8, 4], faces_down: true}
  - {kind: slab, at: [0, 0, 3], size: [4, 4]}
)",
                {{{1, 2, 1.5}, {7, 2, 1.5}, {2, 2, 1.5}}, {{1, 1, 4.5}, {3, 3, 4.5}, {1, 3, 4.5}}});
  ASSERT_THAT(building.storeys, SizeIs(2));
  EXPECT_NEAR(building.storeys[0].floor_m, 0, 0.01);
  EXPECT_NEAR(building.storeys[1].floor_m, 3, 0.01);
  EXPECT_NEAR(building.storeys[0].ceiling_m.value(), 2.6, 0.01);
  EXPECT_FALSE(building.storeys[1].ceiling_m);
  ASSERT_THAT(building.rooms, SizeIs(2));
  EXPECT_NEAR(building.rooms[0].area_m2, 32, 0.5);
  EXPECT_NEAR(building.rooms[1].area_m2, 16, 0.3);
  EXPECT_FALSE(building.rooms[1].height_m);
  const Building open = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [4, 0], [4, 4], [0, 4]], closed: true}
  - {kind: slab, at: [0, 0, 0], size: [4, 4]}
)",
                                  {{{1, 1, 1.5}, {3, 3, 1.5}, {1, 3, 1.5}}});
  EXPECT_FALSE(open.storeys.at(0).ceiling_m);
  EXPECT_LT(MakeWalls(open).at(0).outline_world[2].z(), 4);
}

TEST(BuildBuilding, SplitLevelHasTwoFloorsAndWhatIsFlownOverIsNone) {
  const Building split = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true, height: 3.4}
  - {kind: slab, at: [0, 0, 0], size: [5, 4]}
  - {kind: slab, at: [5, 0, 0.8], size: [5, 4]}
  - {kind: box, at: [5.05, 2, 0], size: [0.1, 4, 0.79]}
  - {kind: slab, at: [0, 0, 3.4], size: [10, 4], faces_down: true}
)",
                                   {{{1, 2, 1.5}, {4, 2, 1.5}, {6, 2, 2.3}, {9, 2, 2.3}}});
  ASSERT_THAT(split.storeys, SizeIs(2));
  EXPECT_NEAR(split.storeys[0].floor_m, 0, 0.01);
  EXPECT_NEAR(split.storeys[1].floor_m, 0.8, 0.01);
  const Building flown = BuildFrom(R"(
  - {kind: wall, points: [[0, 0], [8, 0], [8, 8], [0, 8]], closed: true, height: 6}
  - {kind: slab, at: [0, 0, 0], size: [8, 8]}
  - {kind: box, at: [4, 4, 0], size: [2, 2, 1.2]}
)",
                                   {{{1, 4, 2.5}, {7, 4, 2.5}, {4, 7, 2.5}, {4, 1, 2.5}}});
  ASSERT_THAT(flown.storeys, SizeIs(1));
  EXPECT_NEAR(flown.storeys[0].floor_m, 0, 0.01);
}

TEST(BuildBuilding, CorridorAroundABlockIsOneRoomWithAHole) {
  const Building building = BuildFrom(
      R"(
  - {kind: wall, points: [[0, 0], [12, 0], [12, 9], [0, 9]], closed: true}
  - {kind: wall, points: [[2, 2], [2, 7], [10, 7], [10, 2]], closed: true}
  - {kind: slab, at: [0, 0, 0], size: [12, 9]}
  - {kind: slab, at: [0, 0, 2.7], size: [12, 9], faces_down: true}
)",
      {{{1, 1, 1.5}, {11, 1, 1.5}, {11, 8, 1.5}, {1, 8, 1.5}, {1, 1, 1.5}}});
  EXPECT_THAT(MakeWalls(building), SizeIs(8));
  ASSERT_THAT(building.rooms, SizeIs(1));
  EXPECT_THAT(building.rooms[0].polygon.holes, SizeIs(1));
  EXPECT_NEAR(building.rooms[0].area_m2, 68, 0.7);
  EXPECT_THAT(OpeningsOf(building), IsEmpty());
}

TEST(BuildBuilding, OfficeOfFiveRoomsMeetsItsFigures) {
  const Scene scene =
      ReadScene(std::string(SLCMAP_SOURCE_DIR) + "/config/scenes/office_floor.yaml");
  const std::vector<Vector3d> places = PlacesAlong(
      {{0.9, 0, 1.5},    {2.9, 0, 1.5},   {2.9, -3.8, 1.5}, {2.9, 0, 1.5},     {4.1, 0, 1.5},
       {4.1, 3, 1.5},    {2.8, 3.2, 1.5}, {4.1, 0.2, 1.5},  {8.05, 0, 1.5},    {8.05, -2.4, 1.5},
       {9.4, -2.7, 1.5}, {8.05, 0, 1.5},  {12.1, 0, 1.5},   {12.1, 2.8, 1.5},  {10.6, 3.0, 1.5},
       {12.1, 0.5, 1.5}, {13.3, 0, 1.5},  {13.3, -3, 1.5},  {14.6, -2.7, 1.5}, {13.3, 0, 1.5}},
      0.8);
  const Building building = BuildBuilding(Scan(scene, places), {});
  const BuildingMetrics metrics = EvaluateBuilding(SeenFrom(scene, places), building);
  EXPECT_GE(metrics.walls_found, 0.95 * static_cast<double>(metrics.walls));
  EXPECT_LE(metrics.offset_median_m, 0.01);
  EXPECT_LE(metrics.distance_error_95_m, 0.015);
  EXPECT_GE(metrics.openings_f1, 0.85);
  EXPECT_EQ(metrics.rooms, 6);
  EXPECT_EQ(metrics.rooms_right, 6);
}

}  // namespace
}  // namespace slcmap
