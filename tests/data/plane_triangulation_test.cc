#include <gtest/gtest.h>

#include <limits>

#include "data/core/error.h"
#include "data/core/polygon.h"

namespace slcmap {
namespace {

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
}

TEST(PlaneTriangulationTest, CutsMayPartAPolygon) {
  const std::vector<Polygon> halves = Difference(kSquare, {{{1, -1}, {2, -1}, {2, 5}, {1, 5}}});
  ASSERT_EQ(halves.size(), 2u);
  EXPECT_NEAR(Area(halves[0]), 4, 1e-12);
  EXPECT_NEAR(Area(halves[1]), 8, 1e-12);
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

TEST(PlaneTriangulationTest, SpikesOfAnOutlineAreLeftOut) {
  const Polygon spiked = {{{0, 0}, {4, 0}, {4, 2}, {6, 3}, {4, 2}, {0, 2}}, {}};
  EXPECT_NEAR(AreaOf(Difference(spiked, {{{1, 0}, {2, 0}, {2, 1}, {1, 1}}})), 7, 1e-9);
}

TEST(PlaneTriangulationTest, WhatEnclosesNothingHasNoTriangles) {
  EXPECT_TRUE(Triangulate({}).empty());
  EXPECT_TRUE(Triangulate({{{0, 0}, {1, 1}}, {}}).empty());
  EXPECT_TRUE(Triangulate({{{0, 0}, {1, 1}, {2, 2}}, {}}).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Triangulate({{{0, 0}, {1, nan}, {2, 2}}, {}}), DataError);
}

}  // namespace
}  // namespace slcmap
