#include "mapping/building/faces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "mapping/building/face_surface.h"
#include "mapping/building/free_space.h"
#include "mapping/building/openings.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A wall along x at y = 0, looking to +y, with what is measured of it; `bend` moves it.
class WallSamples {
 public:
  explicit WallSamples(uint32_t seed, double length_m = 6)
      : generator_(seed), length_m_(length_m) {}

  // Points of a part of it, so far before it.
  void AddPoints(
      double before_m, double low_m, double high_m, double step_m = 0.05, double noise_m = 0.01,
      const std::function<double(double x)>& bend = [](double) { return 0.0; }) {
    for (double x = 0; x < length_m_; x += step_m) {
      for (double z = low_m; z < high_m; z += step_m) {
        samples_.push_back({{x, before_m + bend(x) + noise_m * normal_(generator_), z},
                            Vector2d::UnitY(),
                            Vector2d::Zero(),
                            noise_m});
      }
    }
  }

  void AddLine(double before_m, double z_m, double slope = 0, double noise_m = 0) {
    for (double x = 0.05; x < length_m_; x += 0.1) {
      const double y = before_m + slope * (x - 0.5 * length_m_);
      samples_.push_back({{x, y + noise_m * normal_(generator_), z_m},
                          Vector2d::Zero(),
                          Vector2d::UnitX(),
                          std::max(0.002, noise_m)});
    }
  }

  const std::vector<FaceSample>& samples() const { return samples_; }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
  const double length_m_;
  std::vector<FaceSample> samples_;
};

bool AllFree(const Vector2d&) { return true; }

TEST(Faces, IntervalsHoldTheMiddleOfWallsThatBend) {
  // Waves as those of inexact buildings, of all phases.
  int held = 0, all = 0;
  for (int k = 0; k < 40; ++k) {
    const double wave_m = 6 + 0.3 * k, phase = k;
    const auto bend = [&](double x) { return 0.005 * std::sin(2 * M_PI * x / wave_m + phase); };
    WallSamples wall(k, 5);
    wall.AddPoints(0, 0, 2.5, 0.05, 0.01, bend);
    const std::vector<Face> faces = FindFaces(wall.samples(), AllFree, {});
    ASSERT_THAT(faces, SizeIs(1)) << k;
    double mean = 0;
    for (int i = 0; i < 100; ++i) mean += bend(0.05 * i) / 100;
    const double at_middle = faces[0].DistanceTo({2.5, mean});
    ++all;
    held += std::abs(at_middle) <= 1.96 * faces[0].sigma_m ? 1 : 0;
  }
  EXPECT_GE(held, 36);
}

TEST(Faces, LinesOfABlankWallMakeAFaceOnTheFreeSide) {
  std::vector<FaceSample> samples;
  for (double x = 0; x < 4; x += 0.1) {
    for (const double z : {0.09, 2.7}) {
      samples.push_back({{x, 1, z}, Vector2d::Zero(), Vector2d::UnitX(), 0.005});
    }
  }
  const auto faces = FindFaces(
      samples, [](const Vector2d& p) { return p.y() < 1; }, BuildingOptions{});
  ASSERT_THAT(faces, SizeIs(1));
  EXPECT_NEAR(faces[0].normal.y(), -1, 1e-3);
  EXPECT_NEAR(faces[0].offset_m, -1, 0.005);
  EXPECT_THAT(FindFaces(samples, [](const Vector2d&) { return false; }, {}), IsEmpty());
}

TEST(Faces, BeforeACornerIsAFaceWhereEdgesRunAlongIt) {
  // Half a metre across the corner at the origin, as depth of blank walls is rounded off.
  const Vector2d normal = Vector2d(1, 2).normalized(), along(normal.y(), -normal.x());
  WallSamples wall(1, 4);
  wall.AddPoints(0, 0, 2.5);
  std::vector<FaceSample> samples = wall.samples(), edges;
  for (double s = -0.25; s < 0.25; s += 0.03) {
    const Vector2d p = 0.3 * normal + s * along;
    for (double z = 0; z < 2.5; z += 0.05) {
      samples.push_back({{p.x(), p.y(), z}, normal, Vector2d::Zero(), 0.01});
    }
    edges.push_back({{p.x(), p.y(), 0}, Vector2d::Zero(), along, 0.005});
  }
  const auto across = [&](const std::vector<Face>& faces) {
    return std::count_if(faces.begin(), faces.end(),
                         [&](const Face& face) { return face.normal.dot(normal) > 0.99; });
  };
  const auto is_free = [&](const Vector2d& p) { return p.dot(normal) > 0.3; };
  EXPECT_EQ(across(FindFaces(samples, is_free, {})), 0);
  samples.insert(samples.end(), edges.begin(), edges.end());
  EXPECT_EQ(across(FindFaces(samples, is_free, {})), 1);
}

TEST(Faces, ShortFaceGetsTheHeadingOfLongOnes) {
  Face wall;
  wall.heading_sigma_rad = 0.0005;
  wall.to_m = 5;
  Face cheek;
  cheek.normal = Vector2d(std::cos(0.03), std::sin(0.03));
  cheek.heading_sigma_rad = 0.05;
  cheek.to_m = 0.4;
  std::vector<Face> faces = {wall, cheek};
  AgreeHeadings(&faces);
  EXPECT_NEAR(std::atan2(faces[0].normal.y(), faces[0].normal.x()), 0, 1e-3);
  EXPECT_NEAR(std::atan2(faces[1].normal.y(), faces[1].normal.x()), 0, 3e-3);
}

TEST(Faces, MainHeadingIsThatOfMostWalls) {
  Face wall;
  wall.normal = Vector2d(std::cos(0.4), std::sin(0.4));
  wall.to_m = 5;
  Face across = wall;
  across.normal = {-wall.normal.y(), wall.normal.x()};
  Face other;
  other.to_m = 3;
  EXPECT_NEAR(MainHeading({wall, across, other}), 0.4, 1e-9);
}

constexpr double kLength_m = 6;

Face FaceBefore(double offset_m) {
  Face face;
  face.normal = Vector2d::UnitY();
  face.offset_m = offset_m;
  face.heading_sigma_rad = 0.003;
  face.from_m = -kLength_m;
  face.to_m = 0;
  return face;
}

double DistanceAtMiddle(const Face& face) { return face.DistanceTo({0.5 * kLength_m, 0}); }

// How far a face is from the wall that started so far before it.
double OffAfterMove(const WallSamples& wall, double start_m) {
  Face face = FaceBefore(start_m);
  MoveOntoSurface(wall.samples(), 0.045, &face);
  return DistanceAtMiddle(face);
}

TEST(FaceSurface, WallIsBehindItsSkirtingAndFrames) {
  // Blank but for its edge to the ceiling: most of what is seen of it stands before it.
  WallSamples wall(1);
  wall.AddLine(0, 2.7);
  for (const double z : {0.08, 0.09, 2.1}) wall.AddLine(0.015, z);
  wall.AddLine(0.025, 2.15);
  wall.AddPoints(0.015, 0, 0.09);
  EXPECT_NEAR(OffAfterMove(wall, 0.012), 0, 0.003);
}

// That many frames stand equally far before a wall does not make them the wall.
TEST(FaceSurface, FramesOfOneThicknessAreNotTheWall) {
  WallSamples wall(6);
  for (const double z : {0.8, 0.9, 1.2, 1.8, 2.1, 2.2}) wall.AddLine(0.02, z);
  wall.AddPoints(0, 0.1, 2.6, 0.1, 0.02);
  EXPECT_NEAR(OffAfterMove(wall, 0.018), 0, 0.0065);
}

// Stereo has the depth of a frame on the plaster beside it, too, which has less texture.
TEST(FaceSurface, PointsBesideFramesMayBeOfThese) {
  WallSamples wall(9);
  for (const double z : {0.1, 0.9, 1.0, 2.1, 2.2}) {
    wall.AddLine(0.02, z);
    wall.AddPoints(0.02, z - 0.12, z + 0.12, 0.05, 0.02);
  }
  wall.AddPoints(0, 0.3, 0.7, 0.1, 0.02);
  wall.AddPoints(0, 1.2, 1.9, 0.1, 0.02);
  EXPECT_NEAR(OffAfterMove(wall, 0.018), 0, 0.007);
}

// What lines scatter by is no thickness of frames.
TEST(FaceSurface, LinesThatScatterAreTheWall) {
  WallSamples wall(7);
  for (int i = 0; i < 7; ++i) wall.AddLine(0, 0.5 + 0.3 * i, 0, 0.004);
  EXPECT_NEAR(OffAfterMove(wall, 0.005), 0, 0.003);
  wall.AddPoints(0, 0.1, 2.6, 0.11);
  EXPECT_NEAR(OffAfterMove(wall, 0.005), 0, 0.003);
}

TEST(FaceSurface, OneRecessedLineIsNotTheWall) {
  WallSamples wall(8);
  for (int i = 0; i < 6; ++i) wall.AddLine(0, 0.5 + 0.3 * i);
  wall.AddLine(-0.02, 1.1);
  Face face = FaceBefore(0.005);
  EXPECT_LT(MoveOntoSurface(wall.samples(), 0.045, &face), 0.02);
  EXPECT_NEAR(DistanceAtMiddle(face), 0, 0.003);
}

TEST(FaceSurface, StrayPlacesBehindItDoNotMoveIt) {
  WallSamples wall(3);
  wall.AddPoints(0, 0.1, 2.6);
  wall.AddPoints(-0.03, 1, 1.2);
  EXPECT_NEAR(OffAfterMove(wall, 0.005), 0, 0.005);
}

TEST(FaceSurface, HeadingIsThatOfWhatIsOnTheSurface) {
  constexpr double kSlope = 0.002;
  WallSamples wall(4);
  wall.AddLine(0, 2.7, kSlope);
  wall.AddLine(0, 0.1, kSlope);
  wall.AddLine(0.02, 1);  // a rail that is not parallel to it
  Face face = FaceBefore(0.004);
  MoveOntoSurface(wall.samples(), 0.045, &face);
  EXPECT_NEAR(DistanceAtMiddle(face), 0, 0.002);
  EXPECT_NEAR(-face.normal.x(), kSlope, 0.0007);
  // The face covers what it covered.
  EXPECT_NEAR(face.Length(), kLength_m, 1e-9);
}

TEST(FaceSurface, LittleThatIsSeenLeavesItUncertainAndNothingWhereItWas) {
  WallSamples small(5), large(5);
  small.AddPoints(0, 1, 1.1, 0.5);
  large.AddPoints(0, 0.1, 2.6);
  Face face = FaceBefore(0), still = FaceBefore(0.7);
  EXPECT_GT(MoveOntoSurface(small.samples(), 0.045, &face), 0.008);
  EXPECT_LT(MoveOntoSurface(large.samples(), 0.045, &face), 0.006);
  EXPECT_EQ(MoveOntoSurface({}, 0.045, &still), 0);
  EXPECT_EQ(still.offset_m, 0.7);
  EXPECT_EQ(still.normal, Vector2d::UnitY());
}

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

TEST(FindCover, WhatIsSeenThroughInPartsIsAWall) {
  // Whose sills are as blank as may be: nothing but its lintels was measured.
  FaceGrid windows = GridOfAFace(), blank = GridOfAFace(), passage = GridOfAFace();
  Support(0, kFaceLength_m, 2.4, kFaceHeight_m, &windows);
  Pass(0.2, kFaceLength_m - 0.2, 1, 2.4, &windows);
  EXPECT_TRUE(IsWall(FindCover(windows).shares, kGridCell_m));
  // But for its edge to the ceiling, with a few rays that are off.
  Support(0, kFaceLength_m, 2.7, kFaceHeight_m, &blank);
  for (double along_m = 0.1; along_m < kFaceLength_m; along_m += 0.2) {
    Pass(along_m, along_m + kGridCell_m, 0.5, 0.5 + kGridCell_m, &blank);
  }
  EXPECT_TRUE(IsWall(FindCover(blank).shares, kGridCell_m));
  // Between short pieces.
  Support(0.5, 3.5, 2.1, kFaceHeight_m, &passage);
  Support(0.5, 0.8, 0, 2.1, &passage);
  Support(3.2, 3.5, 0, 2.1, &passage);
  Pass(0.8, 3.2, 0, 2.1, &passage);
  EXPECT_TRUE(IsWall(FindCover(passage).shares, kGridCell_m));
}

// A door of which the leaf hides a part; a window is as wide as it was seen.
TEST(FindOpenings, ADoorReachesToTheWallsBesideIt) {
  for (const double low_m : {0.0, 1.0}) {
    FaceGrid grid = GridOfAFace();
    Face face;
    face.to_m = kFaceLength_m;
    Support(0, 1, 0, kFaceHeight_m, &grid);
    Support(2, kFaceLength_m, 0, kFaceHeight_m, &grid);
    Support(1, 2, 2.1, kFaceHeight_m, &grid);
    Support(1, 2, 0, low_m, &grid);
    Pass(1, 1.75, low_m, 2.1, &grid);
    Level level;
    level.top_m = kFaceHeight_m;
    const auto openings = FindOpenings(face, grid, level, {});
    ASSERT_EQ(openings.size(), 1u);
    EXPECT_NEAR(openings[0].from_m, 1, 0.01);
    EXPECT_NEAR(openings[0].to_m, low_m > 0 ? 1.75 : 2, 0.01);
  }
}

// As one sees of an opening whom it is beside: neither its floor nor what is over it.
TEST(FindOpenings, WhatIsSeenThroughIsOpenDownToTheFloorAndUpToTheTopUnlessSomethingStandsThere) {
  struct Case {
    double sill_m, lintel_m;  // that were measured, from the floor and from the top; 0: none
    bool is_passed_over;      // a few rays between it and the top
    double low_m, high_m;     // that it has to have
  };
  for (const Case& each : {Case{0, 0.7, false, 0, 2.1}, Case{0.6, 0.7, false, 0.6, 2.1},
                           Case{0, 0, true, 0, kFaceHeight_m}, Case{0, 0, false, 0, 2.1}}) {
    FaceGrid grid = GridOfAFace();
    Face face;
    face.to_m = kFaceLength_m;
    Support(0, 1, 0, kFaceHeight_m, &grid);
    Support(2, kFaceLength_m, 0, kFaceHeight_m, &grid);
    Support(1, 2, 0, each.sill_m, &grid);
    Support(1, 2, kFaceHeight_m - each.lintel_m, kFaceHeight_m, &grid);
    if (each.is_passed_over) Pass(1.2, 1.4, 2.4, 2.6, &grid);
    Pass(1, 2, 0.7, 2, &grid);
    Level level;
    level.top_m = kFaceHeight_m;
    const auto openings = FindOpenings(face, grid, level, {});
    ASSERT_EQ(openings.size(), 1u);
    EXPECT_NEAR(openings[0].low_m, each.low_m, 0.11);
    EXPECT_NEAR(openings[0].high_m, each.high_m, 0.11);
    EXPECT_EQ(openings[0].IsGap(kFaceHeight_m), each.high_m == kFaceHeight_m);
    EXPECT_EQ(openings[0].kind == OpeningKind::kWindow, each.low_m > 0);
  }
}

// A blank sill and lintel are hit by rays, though no point lies on them.
TEST(FindOpenings, WhatStopsRaysStands) {
  FaceGrid grid = GridOfAFace();
  Face face;
  face.to_m = kFaceLength_m;
  Support(0, 1, 0, kFaceHeight_m, &grid);
  Support(2, kFaceLength_m, 0, kFaceHeight_m, &grid);
  const auto hit = [&](double along_m, double z_m) { grid.AddHit(along_m, z_m); };
  Over(1, 2, 0, 0.6, hit);
  Over(1, 2, 2, kFaceHeight_m, hit);
  Pass(1.5, 1.55, 2.4, 2.45, &grid);  // a ray that ended wrongly
  Pass(1, 2, 0.7, 2, &grid);
  Level level;
  level.top_m = kFaceHeight_m;
  const auto openings = FindOpenings(face, grid, level, {});
  ASSERT_EQ(openings.size(), 1u);
  EXPECT_EQ(openings[0].kind, OpeningKind::kWindow);
  EXPECT_LT(openings[0].high_m, 2.2);
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
