#include "data/core/polygon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "data/core/error.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

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
}

TEST(Polygon, EndsInTheOpenCutNothing) {
  const PlanPoints frame = {{0, 0}, {2, 0}, {2, 1}, {0, 1}, {0, 0}};
  EXPECT_THAT(ArrangementCells({frame, {{0.5, -1}, {0.5, 0.5}}}, kGrid_m), SizeIs(1));
  EXPECT_THAT(ArrangementCells({{{0, 0}, {1, 1}}}, kGrid_m), IsEmpty());
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
}

TEST(Polygon, CommonAreaIsThatOfTheIntersection) {
  EXPECT_NEAR(IntersectionArea(Square(0, 0, 2), Square(1, 1, 2)), 1, 1e-9);
  EXPECT_NEAR(IntersectionArea(Square(0, 0, 1), Square(5, 5, 1)), 0, 1e-9);
}

TEST(Polygon, LinesThatCannotBeAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ArrangementCells({{{0, 0}, {nan, 1}}}, kGrid_m), DataError);
}

}  // namespace
}  // namespace slcmap
