#include "mapping/building/free_space.h"

#include <gtest/gtest.h>

#include <numeric>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

FreeSpace Empty() { return {{Vector2d(0, 0), Vector2d(10, 10)}, 0.1}; }

// Of views with so many rays each; a ray ends at x = its number among all.
std::vector<ViewRays> RaysWith(const std::vector<int>& counts) {
  std::vector<ViewRays> seen;
  int number = 0;
  for (const int count : counts) {
    ViewRays view;
    for (int i = 0; i < count; ++i) {
      view.p_world.emplace_back(static_cast<float>(number++), 0.0F, 0.0F);
      view.sigma_m.push_back(0.01F);
    }
    seen.push_back(view);
  }
  return seen;
}

std::vector<int> CollectRays(const FreeSpaceRays& rays) {
  std::vector<int> numbers;
  for (size_t view = 0; view < rays.views(); ++view) {
    rays.ForEachIn(view, [&](const Vector3d&, const Vector3d& end, double) {
      numbers.push_back(static_cast<int>(end.x()));
    });
  }
  return numbers;
}

TEST(FreeSpace, AddsTheWaysOfAnother) {
  FreeSpace whole = Empty(), first = Empty(), second = Empty();
  for (FreeSpace* space : {&first, &second}) {
    for (int i = 0; i < 2; ++i) space->AddWay({1, 1}, {9, 1});  // three are needed
  }
  EXPECT_FALSE(first.IsFree({5, 1}));
  whole.AddWaysFrom(first);
  whole.AddWaysFrom(second);
  EXPECT_TRUE(whole.IsFree({5, 1}));
  EXPECT_FALSE(whole.IsFree({5, 3}));
}

TEST(FreeSpace, CountsNoMoreWaysThanFit) {
  FreeSpace whole = Empty(), many = Empty();
  for (int i = 0; i < 200; ++i) many.AddWay({1, 1}, {9, 1});
  whole.AddWaysFrom(many);
  whole.AddWaysFrom(many);  // 400 would be 144 in a byte, and 256 more none
  for (int i = 0; i < 56; ++i) whole.AddWay({1, 1}, {9, 1});
  EXPECT_TRUE(whole.IsFree({5, 1}));
}

// Whichever views they are of, also those with fewer rays than one is taken of.
TEST(FreeSpaceRays, AreEverySoManiethOfMany) {
  const auto seen = RaysWith({4, 1, 1, 0, 5, 2});
  EXPECT_EQ(CollectRays(FreeSpaceRays(seen, 6)), (std::vector{0, 3, 6, 9, 12}));
}

TEST(FreeSpaceRays, AreGivenInRangesOfViewsUntilStopped) {
  const auto seen = RaysWith(std::vector<int>(100, 1));
  const FreeSpaceRays rays(seen, 1000);
  size_t next = 0;
  rays.ForSomeViews({}, [&](size_t begin, size_t end) {
    EXPECT_EQ(begin, next);
    next = end;
  });
  EXPECT_EQ(next, 100u);
  const Progress stops([](double share) { return share < 0.5; });
  EXPECT_THROW(rays.ForSomeViews(stops, [](size_t, size_t) {}), StoppedError);
}

constexpr double kGridCell_m = 0.05, kFaceLength_m = 4, kFaceHeight_m = 2.8;

FaceGrid GridOfAFace() {
  Face face;
  face.from_m = 0;
  face.to_m = kFaceLength_m;
  return FaceGrid(face, 0, kFaceHeight_m, kGridCell_m);
}

// Calls `add` for each cell of a rectangle.
template <typename Add>
void Over(double from_m, double to_m, double low_m, double high_m, Add add) {
  for (double along_m = from_m + 0.5 * kGridCell_m; along_m < to_m; along_m += kGridCell_m) {
    for (double z_m = low_m + 0.5 * kGridCell_m; z_m < high_m; z_m += kGridCell_m)
      add(along_m, z_m);
  }
}

void Support(double from_m, double to_m, double low_m, double high_m, FaceGrid* grid) {
  Over(from_m, to_m, low_m, high_m, [&](double along_m, double z_m) {
    grid->AddSupport(along_m, z_m);
    grid->AddHit(along_m, z_m);
  });
}

void Pass(double from_m, double to_m, double low_m, double high_m, FaceGrid* grid) {
  Over(from_m, to_m, low_m, high_m, [&](double along_m, double z_m) {
    for (int i = 0; i < 2; ++i) grid->AddPass(along_m, z_m);
  });
}

// Whose sills are as blank as may be: nothing but its lintels was measured.
TEST(FindCover, AWallOfWindowsIsAWall) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.4, kFaceHeight_m, &grid);
  Pass(0.2, kFaceLength_m - 0.2, 1, 2.4, &grid);
  EXPECT_TRUE(IsWall(FindCover(grid).shares, kGridCell_m));
}

// But for its edge to the ceiling, with a few rays that are off.
TEST(FindCover, ABlankWallThatStrayRaysPassIsAWall) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.7, kFaceHeight_m, &grid);
  for (double along_m = 0.1; along_m < kFaceLength_m; along_m += 0.2) {
    Pass(along_m, along_m + kGridCell_m, 0.5, 0.5 + kGridCell_m, &grid);
  }
  EXPECT_TRUE(IsWall(FindCover(grid).shares, kGridCell_m));
}

TEST(FindCover, AWidePassageBetweenShortPiecesOfAWallIsAWalls) {
  FaceGrid grid = GridOfAFace();
  Support(0.5, 3.5, 2.1, kFaceHeight_m, &grid);
  Support(0.5, 0.8, 0, 2.1, &grid);
  Support(3.2, 3.5, 0, 2.1, &grid);
  Pass(0.8, 3.2, 0, 2.1, &grid);
  EXPECT_TRUE(IsWall(FindCover(grid).shares, kGridCell_m));
}

// As the panes of two windows, behind the wall between them.
TEST(FindCover, WhatNobodySawBetweenIsCoveredButNotMeasured) {
  FaceGrid grid = GridOfAFace();
  Support(0, 1, 0, kFaceHeight_m, &grid);
  Support(3, kFaceLength_m, 0, kFaceHeight_m, &grid);
  const WallCover cover = FindCover(grid);
  const double covered_m =
      kGridCell_m * std::accumulate(cover.shares.begin(), cover.shares.end(), 0.0);
  EXPECT_NEAR(covered_m, kFaceLength_m, 0.2);
  EXPECT_LT(cover.measured_m, kFaceLength_m - 1.5);
}

}  // namespace
}  // namespace slcmap
