// Painted walls that stereo is said not to have measured: what is filled, and what must not be.
#include "mapping/planes/plane_filling.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "data/error.h"
#include "tests/mapping/planes/painted_views.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kWall_m = 2.5;  // y of the wall
constexpr double kFaint = 0.06;

PaintedRectangle Upright(double from_x, double to_x, double low_z, double high_z, double y,
                         double contrast, int seed) {
  return {{from_x, y, low_z}, {to_x - from_x, 0, 0}, {0, 0, high_z - low_z}, 120, contrast, seed};
}

// A wall with a hole from x = -0.6 to 0.6 between two heights, and what is behind it as the last.
std::vector<PaintedRectangle> WallWithHole(double low_z, double high_z,
                                           const PaintedRectangle& behind) {
  return {Upright(-4, -0.6, 0, 3, kWall_m, kFaint, 1), Upright(0.6, 4, 0, 3, kWall_m, kFaint, 2),
          Upright(-0.6, 0.6, 0, low_z, kWall_m, kFaint, 3),
          Upright(-0.6, 0.6, high_z, 3, kWall_m, kFaint, 4), behind};
}

// What was measured: floor and ceiling, which lie out of view, and the lines between them and the
// wall.
struct Measured {
  std::vector<DensePoint> dense;
  std::vector<MapLine> lines;
  std::vector<Sights> sights;

  Measured() {
    for (double x = -2; x < 2; x += 0.04) {
      dense.push_back({{x, -1, 0}, Vector3d::UnitZ(), 0.01, 100});
      dense.push_back({{x, -1, 3}, -Vector3d::UnitZ(), 0.01, 100});
    }
    for (const double z : {0.0, 3.0}) {
      MapLine line;
      line.start_world = {-2, kWall_m, z};
      line.end_world = {2, kWall_m, z};
      line.kind = LineKind::kEdge;
      lines.push_back(line);
    }
  }
};

std::vector<DensePoint> Fill(const PaintedViews& painted, const Measured& measured, int threads = 1,
                             const Progress& progress = {}) {
  const SightDepths depths(measured.dense, 0.04, ViewCameras(painted.views(), painted.rig()));
  return FillPlanes(painted.views(), painted,
                    {measured.dense, 0.04, measured.lines, measured.sights, depths}, {}, threads,
                    progress);
}

struct Box {
  double from_x, to_x, low_z, high_z;
};

// The share of a part of the wall that is filled, by cells of 5 cm.
double Share(const std::vector<DensePoint>& points, const Box& box) {
  const auto inside = std::count_if(points.begin(), points.end(), [&](const DensePoint& point) {
    const Vector3d& p = point.p_world;
    return p.x() > box.from_x && p.x() < box.to_x && p.z() > box.low_z && p.z() < box.high_z;
  });
  const double area_m2 = (box.to_x - box.from_x) * (box.high_z - box.low_z);
  return static_cast<double>(inside) * 0.05 * 0.05 / area_m2;
}

// Of the wall beside the hole, which all views show.
constexpr Box kBeside = {1, 1.6, 0.8, 2.2};

TEST(FillPlanes, FillsAFaintlyPaintedWall) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, kFaint, 1)});
  const std::vector<DensePoint> points = Fill(painted, {});
  EXPECT_GT(Share(points, {-1, 1, 0.8, 2.2}), 0.8);
  for (const DensePoint& point : points) {
    EXPECT_EQ(point.source, DenseSource::kFilledPlane);
    EXPECT_NEAR(point.p_world.y(), kWall_m, 0.04);
    EXPECT_LT(point.normal_world.y(), -0.99);
    EXPECT_NEAR(point.grey, 120, 20);
    EXPECT_GT(point.sigma_m, 0);
  }
}

TEST(FillPlanes, LeavesOutAWallThatImagesSayNothingOf) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, 0, 1)});
  EXPECT_TRUE(Fill(painted, {}).empty());
}

TEST(FillPlanes, LeavesOutAPlaneBeforeTheWall) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m + 0.2, kFaint, 1)});
  EXPECT_TRUE(Fill(painted, {}).empty());
}

TEST(FillPlanes, LeavesOutWhatWasMeasured) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, kFaint, 1)});
  Measured measured;
  for (double x = -0.5; x < 0.5; x += 0.04) {
    for (double z = 1; z < 2; z += 0.04) {
      measured.dense.push_back({{x, kWall_m, z}, -Vector3d::UnitY(), 0.01, 100});
    }
  }
  const std::vector<DensePoint> points = Fill(painted, measured);
  EXPECT_LT(Share(points, {-0.45, 0.45, 1.05, 1.95}), 0.05);
  EXPECT_GT(Share(points, kBeside), 0.5);
}

TEST(FillPlanes, LeavesOutADoorway) {
  const PaintedViews painted(WallWithHole(0, 2.1, Upright(-4, 4, 0, 3, 4.5, kFaint, 5)));
  const std::vector<DensePoint> points = Fill(painted, {});
  EXPECT_GT(Share(points, kBeside), 0.5);
  EXPECT_LT(Share(points, {-0.45, 0.45, 0.5, 1.95}), 0.03);
}

TEST(FillPlanes, LeavesOutANiche) {
  const PaintedViews painted(WallWithHole(0.9, 2.1, Upright(-1, 1, 0.5, 2.5, 2.7, kFaint, 5)));
  const std::vector<DensePoint> points = Fill(painted, {});
  EXPECT_GT(Share(points, kBeside), 0.5);
  EXPECT_LT(Share(points, {-0.45, 0.45, 1.05, 1.95}), 0.03);
}

TEST(FillPlanes, LeavesOutAWindowThatRaysPass) {
  const PaintedViews painted(WallWithHole(0.9, 2.1, Upright(-4, 4, 0, 3, 4.5, 0.3, 5)));
  Measured measured;
  measured.sights = painted.SightsOf({4});
  const std::vector<DensePoint> points = Fill(painted, measured);
  EXPECT_GT(Share(points, kBeside), 0.5);
  EXPECT_EQ(Share(points, {-0.55, 0.55, 0.95, 2.05}), 0);
}

TEST(FillPlanes, LeavesOutWhatRaysPassThoughItsImagesAgree) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, kFaint, 1)});
  Measured measured;
  for (int i = 0; i < 8; ++i) {
    Sights sights{{0, 0, 1.5}, {}, {}};
    for (float x = -0.4F; x <= 0.4F; x += 0.02F) {
      for (float z = -0.4F; z <= 0.4F; z += 0.02F) {
        sights.p_world.emplace_back(2 * x, 2 * kWall_m, 1.5F + 2 * z);
        sights.sigma_m.push_back(0.02F);
      }
    }
    measured.sights.push_back(sights);
  }
  const std::vector<DensePoint> points = Fill(painted, measured);
  EXPECT_GT(Share(points, kBeside), 0.5);
  EXPECT_EQ(Share(points, {-0.35, 0.35, 1.15, 1.85}), 0);
}

TEST(FillPlanes, LeavesOutWhatStandsBeforeTheWall) {
  const PaintedViews painted(
      {Upright(-4, 4, 0, 3, kWall_m, kFaint, 1), Upright(-0.6, 0.6, 0, 3, kWall_m - 0.4, 0.3, 2)});
  const std::vector<DensePoint> points = Fill(painted, {});
  EXPECT_GT(Share(points, kBeside), 0.4);
  EXPECT_LT(Share(points, {-0.3, 0.3, 0.8, 2.2}), 0.03);
}

TEST(FillPlanes, AreTheSameOnAnyNumberOfThreads) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, kFaint, 1)}, 10);
  const std::vector<DensePoint> one = Fill(painted, {}, 1), three = Fill(painted, {}, 3);
  ASSERT_FALSE(one.empty());
  ASSERT_EQ(one.size(), three.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].p_world, three[i].p_world);
    EXPECT_EQ(one[i].sigma_m, three[i].sigma_m);
  }
}

TEST(FillPlanes, EndWhenAsked) {
  const PaintedViews painted({Upright(-4, 4, 0, 3, kWall_m, kFaint, 1)}, 10);
  EXPECT_TRUE(Fill(painted, {}, 1, Progress([](double) { return false; })).empty());
}

}  // namespace
}  // namespace slcmap
