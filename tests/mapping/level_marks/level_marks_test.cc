#include "mapping/level_marks/level_marks.h"

#include <gtest/gtest.h>

#include "data/error.h"
#include "tests/mapping/junctions/room_corner.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using slcmap::testing::AddFloor;
using slcmap::testing::AddWall;
using slcmap::testing::PlaneOf;
using slcmap::testing::WallAndFloor;

constexpr double kCell_m = 0.05;

MapLine Line(const Vector3d& start, const Vector3d& end, LineKind kind = LineKind::kEdge) {
  MapLine line;
  line.start_world = start;
  line.end_world = end;
  line.kind = kind;
  line.observations = 9;
  return line;
}

// A floor, and on it the front of a box at y = 2, 30 cm high.
std::vector<DensePoint> FloorWithBox() {
  std::vector<DensePoint> cloud;
  AddFloor({0, 4}, {0, 2}, 0.004, &cloud);
  AddWall({1, 3}, {0.02, 0.3}, 2, &cloud);
  return cloud;
}

// The same, with floor that is seen behind the box, too.
std::vector<DensePoint> FloorAroundBox() {
  std::vector<DensePoint> cloud = FloorWithBox();
  AddFloor({0, 4}, {2, 3}, 0.004, &cloud);
  return cloud;
}

LineKind KindAfter(const MapLine& line, const std::vector<DensePoint>& cloud,
                   const LevelMarkOptions& options = {},
                   const Building& building = WallAndFloor()) {
  std::vector<MapLine> lines = {line};
  TellLevelMarks(building, cloud, kCell_m, options, &lines);
  return lines.front().kind;
}

TEST(LevelMarks, AreLinesOnAFloorThatGoesOn) {
  const auto cloud = FloorWithBox();
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0.01}), cloud), LineKind::kMark);
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0}, LineKind::kOutline), cloud), LineKind::kMark);
  EXPECT_EQ(KindAfter(Line({1, 0.5, 0}, {2, 1.5, 0}), cloud), LineKind::kMark);
}

TEST(LevelMarks, AreNotWhereSomethingStands) {
  EXPECT_EQ(KindAfter(Line({1, 1.99, 0}, {3, 1.99, 0}), FloorWithBox()), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1.99, 0}, {3, 1.99, 0}), FloorAroundBox()), LineKind::kEdge);
}

TEST(LevelMarks, AreNotWhereTheFloorEnds) {
  std::vector<DensePoint> cloud;
  AddFloor({0, 4}, {0, 2}, 0, &cloud);
  EXPECT_EQ(KindAfter(Line({1, 2, 0}, {3, 2, 0}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 2, 0}, {3, 2, 0}), {}), LineKind::kEdge);
}

TEST(LevelMarks, AreNotOverTheFloorNorAskewOfIt) {
  const auto cloud = FloorWithBox();
  EXPECT_EQ(KindAfter(Line({1, 1, 0.06}, {3, 1, 0.06}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({0.2, 1, -0.04}, {3.8, 1, 0.04}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1, -0.02}, {1.1, 1, 0.02}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {1, 1, 0.05}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {1, 1, 0}), cloud), LineKind::kEdge);
}

TEST(LevelMarks, AreOnCeilingsFromWhichNothingHangs) {
  Building building = WallAndFloor();
  building.planes.push_back(PlaneOf(PlaneKind::kCeiling, -Vector3d::UnitZ(),
                                    {{0, 0, 2.5}, {4, 0, 2.5}, {4, 3, 2.5}, {0, 3, 2.5}}));
  std::vector<DensePoint> cloud;
  AddFloor({0, 4}, {0, 3}, 2.5, &cloud);
  for (DensePoint& point : cloud) point.normal_world = -Vector3d::UnitZ();
  AddWall({1, 3}, {2.52, 2.8}, 1, &cloud);  // in the storey above
  EXPECT_EQ(KindAfter(Line({1, 1, 2.5}, {3, 1, 2.5}), cloud, {}, building), LineKind::kMark);
  AddWall({1, 3}, {2.2, 2.48}, 1, &cloud);
  EXPECT_EQ(KindAfter(Line({1, 1, 2.5}, {3, 1, 2.5}), cloud, {}, building), LineKind::kEdge);
}

// A floor at the height of a ceiling elsewhere in the building: its points do not look down.
TEST(LevelMarks, AreOnSurfacesThatLookAsTheirPlaneDoes) {
  Building building = WallAndFloor();
  building.planes[1] = PlaneOf(PlaneKind::kCeiling, -Vector3d::UnitZ(),
                               {{9, 0, 0}, {12, 0, 0}, {12, 3, 0}, {9, 3, 0}});
  EXPECT_EQ(KindAfter(Line({1, 1.99, 0}, {3, 1.99, 0}), FloorAroundBox(), {}, building),
            LineKind::kEdge);
}

TEST(LevelMarks, OfUnknownKindAreOnFloorsOnly) {
  const MapLine line = Line({1, 1, 0}, {3, 1, 0}, LineKind::kUnknown);
  EXPECT_EQ(KindAfter(line, FloorWithBox()), LineKind::kMark);
  Building building = WallAndFloor();
  building.planes[1].kind = PlaneKind::kCeiling;
  building.planes[1].normal = -Vector3d::UnitZ();
  auto cloud = FloorWithBox();
  for (DensePoint& point : cloud) point.normal_world = -Vector3d::UnitZ();
  EXPECT_EQ(KindAfter(line, cloud, {}, building), LineKind::kUnknown);
}

// Pieces of a line with a gap go together; one that goes on over the floor is none on it.
TEST(LevelMarks, AreWholeLines) {
  std::vector<MapLine> lines = {Line({1.2, 1.99, 0}, {2.8, 1.99, 0}),
                                Line({3.3, 1.99, 0}, {3.6, 1.99, 0})};
  TellLevelMarks(WallAndFloor(), FloorAroundBox(), kCell_m, {}, &lines);
  EXPECT_EQ(lines[0].kind, LineKind::kEdge);
  EXPECT_EQ(lines[1].kind, LineKind::kEdge);
  lines[1].id = 1;
  TellLevelMarks(WallAndFloor(), FloorAroundBox(), kCell_m, {}, &lines);
  EXPECT_EQ(lines[0].kind, LineKind::kEdge);
  EXPECT_EQ(lines[1].kind, LineKind::kMark);
  lines = {Line({1, 1, 0}, {2, 1, 0}), Line({3, 1, 0.2}, {3.5, 1, 0.2})};
  TellLevelMarks(WallAndFloor(), FloorAroundBox(), kCell_m, {}, &lines);
  EXPECT_EQ(lines[0].kind, LineKind::kEdge);
}

TEST(LevelMarks, AreToldByCellsOfAnySize) {
  for (const double cell_m : {0.04, 0.1}) {
    std::vector<MapLine> lines = {Line({1, 1, 0}, {3, 1, 0}), Line({1, 1.99, 0}, {3, 1.99, 0})};
    lines[1].id = 1;
    TellLevelMarks(WallAndFloor(), FloorAroundBox(), cell_m, {}, &lines);
    EXPECT_EQ(lines[0].kind, LineKind::kMark) << cell_m;
    EXPECT_EQ(lines[1].kind, LineKind::kEdge) << cell_m;
  }
}

TEST(LevelMarks, AreNoneWhereTheyAreNotLookedFor) {
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0}), FloorWithBox(), {.find = false}),
            LineKind::kEdge);
  EXPECT_THROW(LevelMarkOptions({.max_standing = 2}).Check(), ConfigError);
}

TEST(LevelMarks, OfAMapJoinItsMarks) {
  MapResult map;
  map.building = WallAndFloor();
  map.dense = FloorAroundBox();
  map.lines = {Line({1, 1, 0}, {3, 1, 0}), Line({1, 1.99, 0}, {3, 1.99, 0})};
  map.lines[1].id = 1;
  map.marks = {Line({1, 0, 1}, {2, 0, 1}, LineKind::kMark)};
  map.marks[0].id = 2;
  MoveLevelMarks({}, &map);
  ASSERT_EQ(map.lines.size(), 1u);
  EXPECT_EQ(map.lines[0].id, 1);
  ASSERT_EQ(map.marks.size(), 2u);
  EXPECT_EQ(map.marks[1].id, 0);
}

}  // namespace
}  // namespace slcmap
