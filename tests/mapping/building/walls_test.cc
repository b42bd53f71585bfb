#include "mapping/building/walls.h"

#include <gtest/gtest.h>

namespace slcmap {
namespace {

using Eigen::Vector2d;

// A wall along x at y = 0, from 0 to 4 m, looking to +y.
BuiltFace WallAlongX() {
  BuiltFace built;
  built.wall.face.normal = Vector2d::UnitY();
  built.wall.face.from_m = -4;
  built.wall.face.to_m = 0;
  built.wall.shares.assign(80, 1);
  built.is_wall = true;
  return built;
}

TEST(ShareBeforeWalls, EndsAtTheFrontOfAWall) {
  const std::vector<BuiltFace> walls = {WallAlongX()};
  EXPECT_NEAR(ShareBeforeWalls(walls, {1, 3}, {1, -1}), 0.75, 1e-12);
  EXPECT_EQ(ShareBeforeWalls(walls, {1, 3}, {1, 1}), 1);
  EXPECT_EQ(ShareBeforeWalls(walls, {1, 3}, {1, -0.05}), 1);  // its own surface
  EXPECT_EQ(ShareBeforeWalls(walls, {1, -3}, {1, 1}), 1);     // from behind: another face is there
  EXPECT_EQ(ShareBeforeWalls(walls, {5, 3}, {5, -1}), 1);     // beside it
}

TEST(ShareBeforeWalls, DoorsLetThroughAndWindowsDoNot) {
  BuiltFace wall = WallAlongX();
  wall.openings.push_back({OpeningKind::kDoor, true, -1.5, -0.5, 0, 2});
  wall.openings.push_back({OpeningKind::kWindow, false, -3.5, -2.5, 1, 2});
  EXPECT_EQ(ShareBeforeWalls({wall}, {1, 3}, {1, -1}), 1);
  EXPECT_NEAR(ShareBeforeWalls({wall}, {3, 3}, {3, -1}), 0.75, 1e-12);
}

TEST(ShareBeforeWalls, WhatIsNoWallOrWasSeenThroughLetsThrough) {
  BuiltFace other = WallAlongX();
  other.is_wall = false;
  EXPECT_EQ(ShareBeforeWalls({other}, {1, 3}, {1, -1}), 1);
  BuiltFace gap = WallAlongX();
  std::fill(gap.wall.shares.begin() + 50, gap.wall.shares.end(), 0);  // from x = 1.5 to 0
  EXPECT_EQ(ShareBeforeWalls({gap}, {1, 3}, {1, -1}), 1);
  EXPECT_NEAR(ShareBeforeWalls({gap}, {3, 3}, {3, -1}), 0.75, 1e-12);
}

// A wall of which half is seen, and a face 15 cm behind it with more of its own seen, between two
// heights.
std::vector<BuiltFace> WallAndFaceBehind(double from_m, double to_m) {
  BuiltFace wall = WallAlongX(), behind = WallAlongX();
  std::fill(wall.wall.shares.begin() + 20, wall.wall.shares.begin() + 60, 0);
  std::fill(behind.wall.shares.begin(), behind.wall.shares.begin() + 20, 0);
  wall.wall.face.high_m = 2.8;
  behind.wall.face.offset_m = -0.15;
  behind.wall.face.mostly_above_m = from_m;
  behind.wall.face.high_m = to_m;
  return {wall, behind};
}

std::vector<bool> AreWalls(std::vector<BuiltFace> faces) {
  Level level;
  level.top_m = 2.8;
  SelectWalls(level, &faces);
  std::vector<bool> are_walls;
  for (const BuiltFace& built : faces) are_walls.push_back(built.is_wall);
  return are_walls;
}

TEST(SelectWalls, PaneBehindAWallIsNoneHoweverMuchMoreIsSeenOfIt) {
  EXPECT_EQ(AreWalls(WallAndFaceBehind(1, 2.3)), (std::vector{true, false}));
}

TEST(SelectWalls, PaneAlongTwoPiecesOfAWallIsNone) {
  std::vector<BuiltFace> faces = WallAndFaceBehind(1, 2.3);
  faces[0].wall.shares.assign(32, 1);
  faces.push_back(faces[0]);
  faces[0].wall.face.to_m = -2.4;
  faces[2].wall.face.from_m = -1.6;
  EXPECT_EQ(AreWalls(faces), (std::vector{true, false, true}));
}

TEST(SelectWalls, WhatIsBehindAShortPieceMayBeTheWall) {
  std::vector<BuiltFace> faces = WallAndFaceBehind(1, 2.3);
  std::fill(faces[0].wall.shares.begin() + 20, faces[0].wall.shares.end(), 0);
  EXPECT_EQ(AreWalls(faces), (std::vector{false, true}));
}

TEST(SelectWalls, WhatGoesFromFloorOrToTheTopBehindALesserFaceIsTheWall) {
  EXPECT_EQ(AreWalls(WallAndFaceBehind(0.1, 2.3)), (std::vector{false, true}));
  std::vector<BuiltFace> faces = WallAndFaceBehind(1, 2.75);
  faces[0].wall.face.high_m = 3.1;  // something above its storey
  EXPECT_EQ(AreWalls(faces), (std::vector{false, true}));
}

}  // namespace
}  // namespace slcmap
