#include <gtest/gtest.h>

#include "mapping/building/free_space.h"

namespace slcmap {
namespace {

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

bool IsWallAt(const FaceGrid& grid, double along_m) {
  return WallShares(grid)[static_cast<size_t>(along_m / kGridCell_m)] > 0;
}

TEST(WallShares, AWallGoesOnOverItsDoor) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.1, kFaceHeight_m, &grid);
  Support(0, 1.5, 0, 2.1, &grid);
  Pass(1.5, 2.5, 0, 2.1, &grid);
  Support(2.5, kFaceLength_m, 0, 2.1, &grid);
  for (const double along_m : {0.5, 2.0, 3.5}) EXPECT_TRUE(IsWallAt(grid, along_m)) << along_m;
}

// With a post that stands beneath it.
TEST(WallShares, ADuctBeneathACeilingIsNoWall) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.5, kFaceHeight_m, &grid);
  Support(1, 1.3, 0, 2.5, &grid);
  Pass(0, 1, 0, 2.5, &grid);
  Pass(1.3, kFaceLength_m, 0, 2.5, &grid);
  EXPECT_FALSE(IsWall(WallShares(grid), kGridCell_m));
}

// Whose sills are as blank as may be: nothing but its lintels was measured.
TEST(WallShares, AWallOfWindowsIsAWall) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.4, kFaceHeight_m, &grid);
  Pass(0.2, kFaceLength_m - 0.2, 1, 2.4, &grid);
  EXPECT_TRUE(IsWall(WallShares(grid), kGridCell_m));
}

// But for its edge to the ceiling, with a few rays that are off.
TEST(WallShares, ABlankWallThatStrayRaysPassIsAWall) {
  FaceGrid grid = GridOfAFace();
  Support(0, kFaceLength_m, 2.7, kFaceHeight_m, &grid);
  for (double along_m = 0.1; along_m < kFaceLength_m; along_m += 0.2) {
    Pass(along_m, along_m + kGridCell_m, 0.5, 0.5 + kGridCell_m, &grid);
  }
  EXPECT_TRUE(IsWall(WallShares(grid), kGridCell_m));
}

TEST(WallShares, AWidePassageBetweenShortPiecesOfAWallIsAWalls) {
  FaceGrid grid = GridOfAFace();
  Support(0.5, 3.5, 2.1, kFaceHeight_m, &grid);
  Support(0.5, 0.8, 0, 2.1, &grid);
  Support(3.2, 3.5, 0, 2.1, &grid);
  Pass(0.8, 3.2, 0, 2.1, &grid);
  EXPECT_TRUE(IsWall(WallShares(grid), kGridCell_m));
}

TEST(WallShares, TheLintelOfAnOpeningBetweenTwoWallsIsAWall) {
  FaceGrid grid = GridOfAFace();
  Support(1.5, 2.7, 2.1, kFaceHeight_m, &grid);
  Pass(1.6, 2.6, 0, 2.1, &grid);
  EXPECT_TRUE(IsWallAt(grid, 2.1));
}

}  // namespace
}  // namespace slcmap
