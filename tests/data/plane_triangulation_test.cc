#include "data/plane_triangulation.h"

#include <gtest/gtest.h>

#include <limits>

#include "data/error.h"

namespace slcmap {
namespace {

double AreaOf(const std::vector<PlanTriangle>& triangles) {
  double area = 0;
  for (const PlanTriangle& t : triangles) area += SignedArea({t.begin(), t.end()});
  return area;
}

const PlanPoints kSquare = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};

TEST(PlaneTriangulationTest, CutsMayTouchEachOtherAndReachBeyond) {
  EXPECT_NEAR(AreaOf(Triangulate(kSquare, {}, 1e-5)), 16, 1e-9);
  EXPECT_NEAR(AreaOf(Triangulate(kSquare, {{{1, 1}, {2, 1}, {2, 2}, {1, 2}}}, 1e-5)), 15, 1e-9);
  const PlanPoints left = {{1, -1}, {2, -1}, {2, 2}, {1, 2}},
                   right = {{2, -1}, {3, -1}, {3, 2}, {2, 2}};
  EXPECT_NEAR(AreaOf(Triangulate(kSquare, {left, right}, 1e-5)), 12, 1e-9);
  EXPECT_TRUE(Triangulate(kSquare, {{{-1, -1}, {5, -1}, {5, 5}, {-1, 5}}}, 1e-5).empty());
}

TEST(PlaneTriangulationTest, OutlinesMayGoEitherWayRoundAndCrossThemselves) {
  EXPECT_NEAR(AreaOf(Triangulate({{0, 4}, {4, 4}, {4, 0}, {0, 0}}, {}, 1e-5)), 16, 1e-9);
  EXPECT_NEAR(AreaOf(Triangulate({{0, 0}, {4, 4}, {4, 0}, {0, 4}}, {}, 1e-5)), 8, 1e-9);
}

TEST(PlaneTriangulationTest, WhatEnclosesNothingHasNoTriangles) {
  EXPECT_TRUE(Triangulate({{0, 0}, {1, 1}}, {}, 1e-5).empty());
  EXPECT_TRUE(Triangulate({{0, 0}, {1, 1}, {2, 2}}, {}, 1e-5).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Triangulate({{0, 0}, {1, nan}, {2, 2}}, {}, 1e-5), DataError);
}

}  // namespace
}  // namespace slcmap
