#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mapping/building/wall_lines.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using ::testing::DoubleNear;
using ::testing::SizeIs;

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

TEST(WallBodies, HoldThePlacesBetweenTheirFaces) {
  const std::vector<WallFace> walls = {FaceAt(1.2, 1, 0, 5), FaceAt(1.0, -1, 1, 6)};
  EXPECT_TRUE(IsInWall(walls, MakeBodies(walls, {}), {2, 1.1}));
  EXPECT_FALSE(IsInWall(walls, MakeBodies(walls, {}), {2, 1.3}));
  EXPECT_FALSE(IsInWall(walls, MakeBodies(walls, {}), {2, 0.9}));
  EXPECT_FALSE(IsInWall(walls, MakeBodies(walls, {}), {5.5, 1.1}));
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

TEST(WallBodies, FacesThatNobodySawAreBehindThoseThatStandAlone) {
  WallFace alone = FaceAt(7, 1, 2, 5);
  alone.shares.front() = 0;  // at one end of it
  std::vector<WallFace> walls = {FaceAt(1.2, 1, 0, 5), FaceAt(1.0, -1, 0, 5), alone};
  const std::vector<WallFace> unseen = UnseenFaces(walls, {});
  ASSERT_THAT(unseen, SizeIs(1));
  const Face& face = unseen[0].face;
  EXPECT_EQ(face.normal, Vector2d(0, -1));
  EXPECT_NEAR(face.DistanceTo({3, 6.8}), 0, 1e-12);
  EXPECT_GT(face.sigma_m, alone.face.sigma_m + 0.02);  // walls need not be alike
  // What is known of it lies opposite.
  const double end_m = face.MeasureAlong(alone.face.PointAt(alone.face.from_m));
  EXPECT_NEAR(end_m, face.to_m, 1e-12);
  EXPECT_EQ(unseen[0].shares.back(), 0);
  EXPECT_THAT(face.to_m - face.from_m, DoubleNear(3, 1e-12));
  walls.push_back(unseen[0]);
  EXPECT_TRUE(IsInWall(walls, MakeBodies(walls, {}), {3, 6.9}));
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
