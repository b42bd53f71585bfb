#include "mapping/building/walls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mapping/building/horizontal_planes.h"
#include "mapping/building/rooms.h"
#include "mapping/building/storeys.h"
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

TEST(ShareBeforeWalls, EndsAtTheFrontOfAWallThatIsThere) {
  const std::vector<BuiltFace> walls = {WallAlongX()};
  EXPECT_NEAR(ShareBeforeWalls(walls, {1, 3}, {1, -1}), 0.75, 1e-12);
  EXPECT_EQ(ShareBeforeWalls(walls, {1, 3}, {1, 1}), 1);
  EXPECT_EQ(ShareBeforeWalls(walls, {1, 3}, {1, -0.05}), 1);  // its own surface
  EXPECT_EQ(ShareBeforeWalls(walls, {1, -3}, {1, 1}), 1);     // from behind: another face is there
  EXPECT_EQ(ShareBeforeWalls(walls, {5, 3}, {5, -1}), 1);     // beside it
  BuiltFace with_openings = WallAlongX(), no_wall = WallAlongX(), gap = WallAlongX();
  with_openings.openings = {{OpeningKind::kDoor, true, -1.5, -0.5, 0, 2},
                            {OpeningKind::kWindow, false, -3.5, -2.5, 1, 2}};
  EXPECT_EQ(ShareBeforeWalls({with_openings}, {1, 3}, {1, -1}), 1);
  EXPECT_NEAR(ShareBeforeWalls({with_openings}, {3, 3}, {3, -1}), 0.75, 1e-12);
  no_wall.is_wall = false;
  EXPECT_EQ(ShareBeforeWalls({no_wall}, {1, 3}, {1, -1}), 1);
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

// A piece of a wall whose top nobody saw.
BuiltFace LowPiece(double length_m) {
  BuiltFace piece = WallAlongX();
  piece.wall.face.from_m = -length_m;
  piece.wall.shares.assign(static_cast<size_t>(std::lround(length_m / piece.wall.step_m)), 0.5);
  piece.wall.measured_m = 0.5 * length_m;
  return piece;
}

BuiltFace BackOf(const BuiltFace& front, double thickness_m) {
  BuiltFace back = front;
  back.wall.face.normal = -front.wall.face.normal;
  back.wall.face.offset_m = thickness_m - front.wall.face.offset_m;
  back.wall.face.from_m = -front.wall.face.to_m;
  back.wall.face.to_m = -front.wall.face.from_m;
  return back;
}

TEST(SelectWalls, WhatIsLongerThanFurnitureOrSeenFromBothSidesIsAWallWhoseTopNobodySaw) {
  const BuiltFace leaf = LowPiece(1);
  EXPECT_EQ(AreWalls({LowPiece(1.6)}), (std::vector{true}));
  EXPECT_EQ(AreWalls({leaf}), (std::vector{false}));
  EXPECT_EQ(AreWalls({leaf, BackOf(leaf, 0.15)}), (std::vector{true, true}));
  EXPECT_EQ(AreWalls({leaf, BackOf(leaf, 0.04)}), (std::vector{false, false}));
  EXPECT_EQ(AreWalls({leaf, BackOf(leaf, 0.5)}), (std::vector{false, false}));  // a cupboard
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

TEST(WallBodies, TypicalThicknessIsThatOfMostWalls) {
  const std::vector<WallFace> walls = {FaceAt(1.2, 1, 0, 5),  FaceAt(1.0, -1, 0, 5),
                                       FaceAt(9.4, 1, 0, 20), FaceAt(9.0, -1, 0, 20),
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

TEST_F(RoomsTest, AreOneThroughAGapFromFloorToTop) {
  for (const double width_m : {0.9, 1.6}) {
    for (int ways = 0; ways < 3; ++ways) {
      free_.AddWay({2, 1}, {2, 4});  // through it
      for (double x = 2; x < 2 + width_m; x += 0.05) free_.AddWay({x, 1}, {x, 4});
    }
    corridor_.gaps = {
        {corridor_.face.MeasureAlong({2, 2}), corridor_.face.MeasureAlong({2 + width_m, 2})}};
    rooms_.gaps = {
        {rooms_.face.MeasureAlong({2 + width_m, 2.15}), rooms_.face.MeasureAlong({2, 2.15})}};
    EXPECT_THAT(Find(), SizeIs(2)) << width_m;
  }
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

TEST_F(RoomsTest, ArePartedByAWallOfDoors) {
  for (double x = 0.525; x < 4.4; x += 0.05) {
    for (int way = 0; way < 3; ++way) free_.AddWay({x, 1}, {x, 3});
  }
  for (WallFace* wall : {&corridor_, &rooms_}) {
    const bool is_turned = wall == &rooms_;
    Uncover(is_turned ? 5.6 : 0.5, is_turned ? 9.5 : 4.4, wall);
    wall->doors = {{wall->face.MeasureAlong({0.5, 2}), wall->face.MeasureAlong({4.4, 2})}};
    if (wall->doors[0].length_m() < 0) std::swap(wall->doors[0].from_m, wall->doors[0].to_m);
  }
  EXPECT_THAT(Find(), SizeIs(3));
}

// Four by four metres.
std::vector<WallFace> SquareWalls() {
  return {Between({4, 0}, {0, 0}), Between({0, 4}, {4, 4}), Between({0, 0}, {0, 4}),
          Between({4, 4}, {4, 0})};
}

// With rays from left to right over a part of it.
FreeSpace FreeBelow(double top_m) {
  FreeSpace free(Eigen::AlignedBox2d(Vector2d(-1, -1), Vector2d(5, 5)), 0.05);
  for (double y = 0.025; y < top_m; y += 0.05) {
    for (int way = 0; way < 3; ++way) free.AddWay({0, y}, {4, y});
  }
  return free;
}

TEST(Rooms, AreWholeWhereWallsEndThemThoughLittleOfThemWasSeen) {
  const FreeSpace free = FreeBelow(0.8);
  const std::vector<FoundRoom> found = FindRooms(SquareWalls(), free, {});
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_NEAR(Area(found[0].polygon), 16, 0.1);
}

// What stands in a corner hides both of its walls.
TEST(Rooms, AreClosedAtCornersThatNobodySaw) {
  FreeSpace free = FreeBelow(1.2);
  for (double y = 2.9; y < 4; y += 0.05) {
    for (int way = 0; way < 3; ++way) free.AddWay({0, y}, {4, y});
  }
  std::vector<WallFace> walls = SquareWalls();
  walls.push_back(Between({2, 1.2}, {2, 0}));
  walls.push_back(Between({0, 2}, {1.2, 2}));
  EXPECT_THAT(FindRooms(walls, free, {}), SizeIs(2));
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
struct CeilingLine {
  Eigen::Vector3d start, end;
};

// Along two walls.
std::vector<CeilingLine> Around(double z_m) {
  return {{{0.1, 0.01, z_m}, {3.9, 0.01, z_m}}, {{3.99, 3.8, z_m}, {3.99, 0.1, z_m}}};
}

struct DarkCeiling {
  const char* what;
  std::optional<double> height_m;
  std::vector<std::vector<CeilingLine>> lines;
  double lamps_m = 1.2, bounded = 1, seen_m = 1.2;  // of the room, at the height of lamps
};

std::optional<double> HeightUnder(const DarkCeiling& ceiling) {
  BuildingInput input;
  for (const std::vector<CeilingLine>& lines : ceiling.lines) {
    for (const CeilingLine& line : lines) {
      input.lines.emplace_back().start_world = line.start;
      input.lines.back().end_world = line.end;
    }
  }
  for (double x = 0.1; x < ceiling.lamps_m; x += 0.1) {
    for (double y = 0.1; y < ceiling.seen_m; y += 0.1) {
      input.points.push_back({{x, y, 2.44}, {0, 0, -1}, 0.01});
    }
  }
  Room room = SquareRoom();
  room.bounded = ceiling.bounded;
  std::vector<BuildingPlane> planes;
  AddFloorAndCeiling(input, {0, 2.44, 2.44, {}}, &room, &planes);
  return room.height_m;
}

TEST(HorizontalPlanes, ADarkCeilingIsAtTheTopOfItsWalls) {
  const CeilingLine single = {{0.1, 0.01, 2.5}, {1.9, 0.01, 2.5}};
  std::vector<CeilingLine> cornice;
  for (int i = 0; i < 4; ++i) {
    cornice.push_back({{0.1, 0.01 * i, 2.5}, {1.9, 0.01 * i, 2.5}});
  }
  for (const DarkCeiling& row : std::vector<DarkCeiling>{
           {"also with a line in the middle of the room",
            2.5,
            {Around(2.5), {{{1, 2, 2.6}, {3, 2, 2.6}}}}},
           {"nothing is seen of it", std::nullopt, {}, 0},
           {"there are cupboards alone", std::nullopt, {Around(2.1)}, 0},
           {"there is one above the cupboards", 2.5, {Around(2.1), Around(2.5)}, 0},
           {"a single line tells little", 2.44, {{single}}},
           {"but where no other is known", 2.5, {{single}}, 1.2, 0.25},
           {"lines beside each other count once", 2.44, {cornice}},
           // Rails, the ceiling, a floor.
           {"not the floor above nor what hangs", 2.52, {Around(2.46), Around(2.52), Around(2.74)}},
           {"most of it is seen", 2.44, {Around(2.5)}, 4, 1, 4}}) {
    const auto height_m = HeightUnder(row);
    ASSERT_EQ(height_m.has_value(), row.height_m.has_value()) << row.what;
    if (height_m) EXPECT_NEAR(*height_m, *row.height_m, 0.003) << row.what;
  }
}

// A blank ceiling, of which only the edges of walls and of a lamp are seen.
class BlankCeiling : public ::testing::Test {
 protected:
  BlankCeiling() {
    for (double x = 0; x < 4; x += 0.1) {
      input_.trajectory_world.emplace_back(x, 2, 1.5);
      for (double y = 0; y < 4; y += 0.1) input_.points.push_back({{x, y, 0}, {0, 0, 1}, 0.01});
      for (double z = 0; z < 2.5; z += 0.1) input_.points.push_back({{x, 0, z}, {0, 1, 0}, 0.01});
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
  AddEdge(3.6, 5);    // far above all that stands
  for (const double x_m : {20, 30}) {
    input_.lines.push_back(input_.lines[0]);  // of another hall
    input_.lines.back().start_world = {x_m, 0, 3};
    input_.lines.back().end_world = {x_m + 5, 0, 3};
  }
  EXPECT_NEAR(Ceiling().value(), 2.704, 1e-9);
}

TEST_F(BlankCeiling, IsAboveTheLampsThatHangFromIt) {
  AddEdge(2.62, 4);
  AddEdge(2.7, 1.2);
  EXPECT_NEAR(Ceiling().value(), 2.7, 1e-9);
}

TEST_F(BlankCeiling, IsNotBetweenFloorsThatAreAStepApart) {
  for (double x = 5; x < 9; x += 0.1) {
    input_.trajectory_world.emplace_back(x, 2, 3.42);
    for (double y = 0; y < 4; y += 0.1) input_.points.push_back({{x, y, 1.92}, {0, 0, 1}, 0.01});
  }
  AddEdge(1.88, 4);
  ASSERT_EQ(FindLevels(input_).size(), 2u);
  EXPECT_FALSE(Ceiling().has_value());
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
