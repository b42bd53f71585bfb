#include "mapping/level_marks.h"

#include <gtest/gtest.h>

#include "data/error.h"
#include "tests/mapping/junctions/room_corner.h"

namespace slcmap {
namespace {

using slcmap::testing::AddFloor;
using slcmap::testing::AddWall;
using slcmap::testing::WallAndFloor;

constexpr double kVoxel_m = 0.04;

MapLine Line(const Eigen::Vector3d& start, const Eigen::Vector3d& end,
             LineKind kind = LineKind::kEdge) {
  MapLine line;
  line.start_world = start;
  line.end_world = end;
  line.kind = kind;
  line.observations = 9;
  return line;
}

// A floor, and on it a box from y = 2 on, 30 cm high.
std::vector<DensePoint> FloorWithBox() {
  std::vector<DensePoint> cloud;
  AddFloor({0, 4}, {0, 2}, 0.004, &cloud);
  AddWall({1, 3}, {0.02, 0.3}, 2, &cloud);
  return cloud;
}

LineKind KindAfter(const MapLine& line, const std::vector<DensePoint>& cloud,
                   const LevelMarkOptions& options = {}) {
  std::vector<MapLine> lines = {line};
  TellLevelMarks(WallAndFloor(), cloud, kVoxel_m, options, &lines);
  return lines.front().kind;
}

TEST(LevelMarks, AreLinesOnAFloorThatGoesOn) {
  const auto cloud = FloorWithBox();
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0.01}), cloud), LineKind::kMark);
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0}, LineKind::kOutline), cloud), LineKind::kMark);
  EXPECT_EQ(KindAfter(Line({1, 0.5, 0}, {2, 1.5, 0}), cloud), LineKind::kMark);
}

TEST(LevelMarks, AreNotWhereSomethingStands) {
  const auto cloud = FloorWithBox();
  EXPECT_EQ(KindAfter(Line({1, 1.99, 0}, {3, 1.99, 0}), cloud), LineKind::kEdge);
  // A box whose front the floor is seen behind, too.
  auto around = cloud;
  AddFloor({0, 4}, {2, 3}, 0.004, &around);
  EXPECT_EQ(KindAfter(Line({1, 1.99, 0}, {3, 1.99, 0}), around), LineKind::kEdge);
}

TEST(LevelMarks, AreNotWhereTheFloorEnds) {
  std::vector<DensePoint> cloud;
  AddFloor({0, 4}, {0, 2}, 0, &cloud);
  EXPECT_EQ(KindAfter(Line({1, 2, 0}, {3, 2, 0}), cloud), LineKind::kEdge);
}

TEST(LevelMarks, AreNotOverTheFloorNorAskewOfIt) {
  const auto cloud = FloorWithBox();
  EXPECT_EQ(KindAfter(Line({1, 1, 0.06}, {3, 1, 0.06}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1, -0.1}, {3, 1, 0.1}), cloud), LineKind::kEdge);
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {1, 1, 0.05}), cloud), LineKind::kEdge);
}

TEST(LevelMarks, AreNotOfUnknownKind) {
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0}, LineKind::kUnknown), FloorWithBox()),
            LineKind::kUnknown);
}

// Pieces of a line with a gap go together.
TEST(LevelMarks, AreWholeLines) {
  std::vector<MapLine> lines = {Line({1.2, 1.99, 0}, {2.8, 1.99, 0}),
                                Line({3.2, 1.99, 0}, {3.5, 1.99, 0})};
  auto cloud = FloorWithBox();
  AddFloor({0, 4}, {2, 3}, 0.004, &cloud);
  TellLevelMarks(WallAndFloor(), cloud, kVoxel_m, {}, &lines);
  EXPECT_EQ(lines[0].kind, LineKind::kEdge);
  EXPECT_EQ(lines[1].kind, LineKind::kEdge);
  lines[1].id = 1;
  TellLevelMarks(WallAndFloor(), cloud, kVoxel_m, {}, &lines);
  EXPECT_EQ(lines[0].kind, LineKind::kEdge);
  EXPECT_EQ(lines[1].kind, LineKind::kMark);
}

TEST(LevelMarks, AreNoneWhereTheyAreNotLookedFor) {
  EXPECT_EQ(KindAfter(Line({1, 1, 0}, {3, 1, 0}), FloorWithBox(), {.find = false}),
            LineKind::kEdge);
  EXPECT_THROW(LevelMarkOptions({.max_standing = 2}).Check(), ConfigError);
}

}  // namespace
}  // namespace slcmap
