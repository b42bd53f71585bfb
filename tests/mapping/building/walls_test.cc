#include "mapping/building/walls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mapping/building/wall_lines.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using ::testing::SizeIs;

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

// A wall of which half is seen, and a face 25 cm behind it with more of its own seen.
std::vector<BuiltFace> WallAndFaceBehind() {
  BuiltFace wall = WallAlongX(), behind = WallAlongX();
  std::fill(wall.wall.shares.begin() + 20, wall.wall.shares.begin() + 60, 0);
  std::fill(behind.wall.shares.begin(), behind.wall.shares.begin() + 20, 0);
  behind.wall.face.offset_m = -0.25;
  wall.wall.measured_m = 40 * wall.wall.step_m;
  behind.wall.measured_m = 60 * wall.wall.step_m;
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

TEST(SelectWalls, WhatIsBehindAShortPieceMayBeTheWall) {
  std::vector<BuiltFace> faces = WallAndFaceBehind();
  faces[0].wall.measured_m = 1;
  EXPECT_EQ(AreWalls(faces), (std::vector{false, true}));
}

TEST(SelectWalls, WhatStandsFromFloorToTopHidesWhatIsBehind) {
  std::vector<BuiltFace> faces = WallAndFaceBehind();
  for (const double share : faces[0].wall.shares) faces[0].wall.is_solid.push_back(share > 0);
  EXPECT_EQ(AreWalls(faces), (std::vector{true, true}));  // each where the other is not
}

// A face along x at a height in the plan, seen from above it (+1) or below it (-1).
WallFace FaceAt(double y_m, double side, double from_x_m, double to_x_m) {
  WallFace wall;
  wall.face.normal = {0, side};
  wall.face.offset_m = side * y_m;
  const double a = wall.face.MeasureAlong({from_x_m, y_m}),
               b = wall.face.MeasureAlong({to_x_m, y_m});
  wall.face.from_m = std::min(a, b);
  wall.face.to_m = std::max(a, b);
  const auto steps = static_cast<size_t>(std::lround((to_x_m - from_x_m) / wall.step_m));
  wall.shares.assign(steps, 1);
  return wall;
}

TEST(WallBodies, AreBetweenFacesThatLookAwayFromEachOther) {
  const WallFace upper = FaceAt(1.2, 1, 0, 5), lower = FaceAt(1.0, -1, 1, 6);
  const auto body = BodyBetween(upper.face, lower.face, {});
  ASSERT_TRUE(body);
  EXPECT_NEAR(body->thickness_m, 0.2, 1e-12);
  EXPECT_NEAR(body->to_m - body->from_m, 4, 1e-12);
  // Faces that look at each other are two walls of a room.
  EXPECT_FALSE(BodyBetween(FaceAt(1.0, 1, 0, 5).face, FaceAt(1.2, -1, 0, 5).face, {}));
  EXPECT_FALSE(BodyBetween(upper.face, FaceAt(0.2, -1, 0, 5).face, {}));
  EXPECT_FALSE(BodyBetween(upper.face, FaceAt(1.0, -1, 4.9, 9).face, {}));
}

TEST(WallBodies, TypicalThicknessIsThatOfMostOfTheLength) {
  const std::vector<WallFace> walls = {FaceAt(1.2, 1, 0, 5),  FaceAt(1.0, -1, 0, 5),
                                       FaceAt(9.4, 1, 0, 2),  FaceAt(9.0, -1, 0, 2),
                                       FaceAt(20.1, 1, 0, 1), FaceAt(20.0, -1, 0, 1)};
  EXPECT_NEAR(TypicalThickness(MakeBodies(walls, {}), {}), 0.2, 1e-12);
  BuildingOptions options;
  options.assumed_thickness_m = 0.17;
  EXPECT_EQ(TypicalThickness(MakeBodies({FaceAt(1, 1, 0, 5)}, options), options), 0.17);
}

TEST(WallBodies, WallWhoseBackWasSeenInPartGoesOnAtItsOwnThickness) {
  const std::vector<WallFace> walls = {FaceAt(1.3, 1, 0, 9), FaceAt(1.0, -1, 0, 4),
                                       FaceAt(1.0, -1, 4.2, 6), FaceAt(20.1, 1, 0, 20),
                                       FaceAt(20.0, -1, 0, 20)};
  const std::vector<WallFace> unseen = UnseenFaces(walls, {});
  ASSERT_THAT(unseen, SizeIs(1));  // not where a wall meets it, at 4.1
  const Face& face = unseen[0].face;
  EXPECT_NEAR(face.DistanceTo({7, 1.0}), 0, 1e-12);
  const double a_m = face.PointAt(face.from_m).x(), b_m = face.PointAt(face.to_m).x();
  EXPECT_NEAR(std::min(a_m, b_m), 6, 0.06);
  EXPECT_NEAR(std::max(a_m, b_m), 9, 1e-9);
}

}  // namespace
}  // namespace slcmap
