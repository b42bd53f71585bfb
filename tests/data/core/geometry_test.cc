#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "data/core/error.h"
#include "data/core/polygon.h"
#include "data/core/progress.h"
#include "data/core/rigid_transform.h"

namespace slcmap {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Rotation, LogInvertsExpFromTinyToPi) {
  for (const double angle_rad : {0.0, 1e-9, 1e-6, 1e-3, 0.5, 3.0, 3.141}) {
    const Eigen::Vector3d omega = angle_rad * Eigen::Vector3d(1, -2, 0.5).normalized();
    Eigen::Quaterniond q = ExpRotation(omega);
    EXPECT_LT((LogRotation(q) - omega).norm(), 1e-12) << angle_rad;
    q.coeffs() *= -1;  // the same rotation
    EXPECT_LT((LogRotation(q) - omega).norm(), 1e-12) << angle_rad;
  }
}

TEST(Rotation, RightJacobianMatchesDifferences) {
  for (const double angle_rad : {1e-6, 0.01, 1.0, 2.5}) {
    const Eigen::Vector3d omega = angle_rad * Eigen::Vector3d(0.2, 1, -0.7).normalized();
    const Eigen::Matrix3d jacobian = RightJacobian(omega);
    for (int k = 0; k < 3; ++k) {
      const double step = 1e-6;
      const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d difference =
          LogRotation(ExpRotation(omega).conjugate() * ExpRotation(omega + d)) / step;
      EXPECT_LT((difference - jacobian.col(k)).norm(), 1e-5);
    }
    EXPECT_LT((jacobian * RightJacobianInverse(omega) - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(RigidTransform, OfAMatrixNeedsARotationAndTheLastRow) {
  const Eigen::Matrix4d good = Eigen::Matrix4d::Identity();
  EXPECT_NO_THROW(RigidTransformFromMatrix(good, "T_BS"));
  for (const auto& [row, column] : {std::pair{0, 0}, {3, 2}}) {
    Eigen::Matrix4d wrong = good;
    wrong(row, column) += 0.1;
    EXPECT_THROW(RigidTransformFromMatrix(wrong, "T_BS"), DataError) << row;
  }
}

constexpr double kGrid_m = 1e-4;

Polygon Square(double x, double y, double side) {
  return {{{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}}, {}};
}

TEST(Polygon, StraightenedKeepsCornersAndNothingElse) {
  const PlanPoints outline = {{0, 0}, {2, 5e-4}, {4, 0}, {4, 3}, {1, 3}, {0, 3}};
  EXPECT_THAT(Straightened(outline, 1e-3, 2e-4),
              ElementsAre(Eigen::Vector2d(0, 0), Eigen::Vector2d(4, 0), Eigen::Vector2d(4, 3),
                          Eigen::Vector2d(0, 3)));
  EXPECT_THAT(Straightened({{0, 0}, {1, 0}, {2, 0}}, 1e-3, 2e-4), SizeIs(3));
}

TEST(Polygon, StraightenedKeepsACornerOfTwoPointsWhereverItStarts) {
  PlanPoints outline = {{0, 0}, {4, 0}, {4, 3}, {5e-4, 3}, {0, 3 - 5e-4}};
  for (size_t i = 0; i < outline.size(); ++i) {
    const PlanPoints corners = Straightened(outline, 1e-3, 2e-4);
    EXPECT_THAT(corners, SizeIs(4));
    EXPECT_NEAR(SignedArea(corners), 12, 0.01);
    std::rotate(outline.begin(), outline.begin() + 1, outline.end());
  }
}

TEST(Polygon, HolesAreOutside) {
  Polygon ring = Square(0, 0, 3);
  ring.holes = {{{1, 1}, {1, 2}, {2, 2}, {2, 1}}};
  EXPECT_DOUBLE_EQ(Area(ring), 8);
  EXPECT_DOUBLE_EQ(Perimeter(ring), 16);
  EXPECT_TRUE(Contains(ring, {0.5, 0.5}));
  EXPECT_FALSE(Contains(ring, {1.5, 1.5}));
  EXPECT_FALSE(Contains(ring, {3.5, 1.5}));
}

TEST(Polygon, CrossingLinesCutCellsThatShareTheirCorners) {
  const PlanPoints frame = {{0, 0}, {2, 0}, {2, 1}, {0, 1}, {0, 0}};
  const std::vector<Polygon> cells = ArrangementCells({frame, {{0.5, -1}, {1.5, 2}}}, kGrid_m);
  ASSERT_THAT(cells, SizeIs(2));
  EXPECT_NEAR(Area(cells[0]) + Area(cells[1]), 2, 1e-9);
  EXPECT_NEAR(Area(cells[0]), 1, 1e-3);
  // Ends in the open cut nothing.
  EXPECT_THAT(ArrangementCells({frame, {{0.5, -1}, {0.5, 0.5}}}, kGrid_m), SizeIs(1));
  EXPECT_THAT(ArrangementCells({{{0, 0}, {1, 1}}}, kGrid_m), IsEmpty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ArrangementCells({{{0, 0}, {nan, 1}}}, kGrid_m), DataError);
}

TEST(Polygon, UnionOfARingHasAHole) {
  std::vector<Polygon> squares;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      if (x != 1 || y != 1) squares.push_back(Square(x, y, 1));
    }
  }
  const std::vector<Polygon> ring = Union(squares, kGrid_m);
  ASSERT_THAT(ring, SizeIs(1));
  EXPECT_THAT(ring[0].holes, SizeIs(1));
  EXPECT_NEAR(Area(ring[0]), 8, 1e-9);
  EXPECT_GT(SignedArea(ring[0].outline), 0);
  EXPECT_LT(SignedArea(ring[0].holes[0]), 0);
  EXPECT_NEAR(IntersectionArea(Square(0, 0, 2), Square(1, 1, 2)), 1, 1e-9);
  EXPECT_NEAR(IntersectionArea(Square(0, 0, 1), Square(5, 5, 1)), 0, 1e-9);
}

double AreaOf(const std::vector<Polygon>& parts) {
  double area = 0;
  for (const Polygon& part : parts) {
    for (const PlanTriangle& t : Triangulate(part)) area += SignedArea({t.begin(), t.end()});
  }
  return area;
}

const Polygon kSquare = {{{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {}};

TEST(PlaneTriangulationTest, CutsMayTouchEachOtherAndReachBeyond) {
  EXPECT_NEAR(AreaOf(Difference(kSquare, {})), 16, 1e-9);
  EXPECT_NEAR(AreaOf(Difference(kSquare, {{{1, 1}, {2, 1}, {2, 2}, {1, 2}}})), 15, 1e-9);
  const PlanPoints left = {{1, -1}, {2, -1}, {2, 2}, {1, 2}},
                   right = {{2, -1}, {3, -1}, {3, 2}, {2, 2}};
  EXPECT_NEAR(AreaOf(Difference(kSquare, {left, right})), 12, 1e-9);
  EXPECT_TRUE(Difference(kSquare, {{{-1, -1}, {5, -1}, {5, 5}, {-1, 5}}}).empty());
  const std::vector<Polygon> halves = Difference(kSquare, {{{1, -1}, {2, -1}, {2, 5}, {1, 5}}});
  ASSERT_EQ(halves.size(), 2u);
  EXPECT_NEAR(Area(halves[0]), 4, 1e-12);
  EXPECT_NEAR(Area(halves[1]), 8, 1e-12);
  // Spikes of an outline are left out.
  const Polygon spiked = {{{0, 0}, {4, 0}, {4, 2}, {6, 3}, {4, 2}, {0, 2}}, {}};
  EXPECT_NEAR(AreaOf(Difference(spiked, {{{1, 0}, {2, 0}, {2, 1}, {1, 1}}})), 7, 1e-9);
}

TEST(PlaneTriangulationTest, HolesStayEmpty) {
  const Polygon ring = {kSquare.outline, {{{1, 1}, {1, 3}, {3, 3}, {3, 1}}}};
  EXPECT_NEAR(AreaOf({ring}), 12, 1e-9);
  for (const PlanTriangle& t : Triangulate(ring)) {
    EXPECT_GT(SignedArea({t[0], t[1], t[2]}), 0);
    EXPECT_TRUE(Contains(ring, (t[0] + t[1] + t[2]) / 3));
  }
}

TEST(PlaneTriangulationTest, OutlinesMayGoEitherWayRoundAndCrossThemselves) {
  EXPECT_NEAR(AreaOf({{{{0, 4}, {4, 4}, {4, 0}, {0, 0}}, {}}}), 16, 1e-9);
  EXPECT_NEAR(AreaOf({{{{0, 0}, {4, 4}, {4, 0}, {0, 4}}, {}}}), 8, 1e-9);
}

TEST(PlaneTriangulationTest, WhatEnclosesNothingHasNoTriangles) {
  EXPECT_TRUE(Triangulate({}).empty());
  EXPECT_TRUE(Triangulate({{{0, 0}, {1, 1}}, {}}).empty());
  EXPECT_TRUE(Triangulate({{{0, 0}, {1, 1}, {2, 2}}, {}}).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Triangulate({{{0, 0}, {1, nan}, {2, 2}}, {}}), DataError);
}

TEST(ProgressTest, PartCoversItsPartOfTheWhole) {
  std::vector<double> reported;
  const Progress whole([&](double done) {
    reported.push_back(done);
    return true;
  });
  const Progress part = whole.Part(0.2, 0.6);
  part.Report(0);
  part.Report(1);
  part.Part(0.5, 1).Report(0.5);  // a part of the part
  EXPECT_THAT(reported, ElementsAre(DoubleEq(0.2), DoubleEq(0.6), DoubleEq(0.5)));
}

}  // namespace
}  // namespace slcmap
