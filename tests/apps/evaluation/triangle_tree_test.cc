#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "apps/evaluation/truth.h"
#include "data/core/error.h"
#include "data/io/ply.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

// A bumpy floor of many triangles, about z = 0.
std::vector<Triangle> Floor() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bump(-0.05, 0.05);
  std::vector<Triangle> triangles;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 20; ++y) {
      const Eigen::Vector3d a(x, y, bump(random)), b(x + 1, y, bump(random));
      const Eigen::Vector3d c(x + 1, y + 1, bump(random)), d(x, y + 1, bump(random));
      triangles.push_back({a, b, c});
      triangles.push_back({a, c, d});
    }
  }
  return triangles;
}

// By looking at each triangle alone.
double LeastOfEach(const std::vector<Triangle>& triangles, const auto& measure) {
  double least = HUGE_VAL;
  for (const Triangle& triangle : triangles) {
    least = std::min(least, measure(TriangleTree({triangle})));
  }
  return least;
}

TEST(TriangleTree, FindsWhatARayHitsFirst) {
  const std::vector<Triangle> triangles = Floor();
  const TriangleTree tree(triangles);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-2, 22);
  int hits = 0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d origin(place(random), place(random), 3);
    const Eigen::Vector3d target(place(random), place(random), -0.2);
    const Eigen::Vector3d direction = (target - origin).normalized();
    const double expected = LeastOfEach(
        triangles, [&](const TriangleTree& one) { return one.FirstHit_m(origin, direction); });
    EXPECT_EQ(tree.FirstHit_m(origin, direction), expected);
    hits += std::isfinite(expected);
  }
  EXPECT_GT(hits, 20);
  EXPECT_LT(hits, 100);
}

TEST(TriangleTree, FollowsARayNoFurtherThanAsked) {
  const TriangleTree tree(Floor());
  const Eigen::Vector3d origin(5.3, 5.4, 3), down = -Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(tree.FirstHit_m(origin, down), 3, 0.06);
  EXPECT_FALSE(std::isfinite(tree.FirstHit_m(origin, down, 2.5)));
  EXPECT_FALSE(std::isfinite(tree.FirstHit_m(origin, -down)));
}

TEST(TriangleTree, MeasuresDistancesToFacesEdgesAndCorners) {
  const TriangleTree one({Triangle{Eigen::Vector3d(0, 0, 0), {2, 0, 0}, {0, 2, 0}}});
  EXPECT_NEAR(one.Distance_m({0.5, 0.5, -0.3}, 10), 0.3, 1e-12);
  EXPECT_NEAR(one.Distance_m({1, -0.4, 0.3}, 10), 0.5, 1e-12);
  EXPECT_NEAR(one.Distance_m({-3, -4, 0}, 10), 5, 1e-12);
  EXPECT_NEAR(one.Distance_m({2, 2, 0}, 10), std::sqrt(2), 1e-12);
  EXPECT_EQ(one.Distance_m({0, 0, 20}, 10), 10);
}

TEST(TriangleTree, MeasuresTheLeastDistanceOfMany) {
  const std::vector<Triangle> triangles = Floor();
  const TriangleTree tree(triangles);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2, 22), height(-1, 1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p(place(random), place(random), height(random));
    const double expected =
        LeastOfEach(triangles, [&](const TriangleTree& one) { return one.Distance_m(p, 100); });
    EXPECT_NEAR(tree.Distance_m(p, 100), expected, 1e-12);
  }
}

TEST(TriangleTree, OfNothingIsNeverHit) {
  const TriangleTree none({});
  EXPECT_FALSE(std::isfinite(none.FirstHit_m({0, 0, 0}, {1, 0, 0})));
  EXPECT_EQ(none.Distance_m({0, 0, 0}, 3), 3);
}

TEST(ReadSurfaces, CutsFacesIntoTrianglesAndRefusesWhatIsNoMesh) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("surfaces.ply");
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  vertices.AppendRow({0, 0, 0});
  vertices.AppendRow({1, 0, 0});
  vertices.AppendRow({1, 1, 0});
  vertices.AppendRow({0, 1, 0});
  WritePly(path, {{}, {vertices}, {{0, 1, 2, 3}}});
  EXPECT_EQ(ReadSurfaces(path).size(), 2u);
  WritePly(path, {{}, {vertices}, {{0, 1, 9}}});
  EXPECT_THROW(ReadSurfaces(path), DataError);
  WritePly(path, {{}, {vertices}, {}});
  EXPECT_THROW(ReadSurfaces(path), DataError);
}

}  // namespace
}  // namespace slcmap
