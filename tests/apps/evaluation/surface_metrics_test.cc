// A cloud and an occupancy map of a room of which everything is known.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "apps/evaluation/truth.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/ply.h"
#include "tests/testing/forward_rig.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using testing::ForwardRig;
using testing::Standing;
using testing::WallAtX;

TEST(SeenSurfaces, AreThoseInSightWithinRange) {
  std::vector<Triangle> triangles = WallAtX(3, 1);
  for (const double hidden_m : {4.0, 20.0}) {
    const auto wall = WallAtX(hidden_m, 0.5);
    triangles.insert(triangles.end(), wall.begin(), wall.end());
  }
  const TriangleTree surfaces(triangles);
  VisibilityOptions options;
  options.stride_px = 2;
  const std::vector<ReferenceView> views =
      ReferenceViews(surfaces, Standing(1), ForwardRig(), options);
  EXPECT_EQ(views.size(), 5u);
  const std::vector<SeenSample> seen = SeenSurfaces(views, 0.05);
  // 2 x 2 m in cells of 5 cm.
  EXPECT_NEAR(static_cast<double>(seen.size()), 1600, 100);
  for (const SeenSample& sample : seen) {
    EXPECT_NEAR(sample.p.x(), 3, 1e-6);
    EXPECT_NEAR(sample.range_m, sample.p.norm(), 1e-6);
  }
}

TEST(CloudMetrics, CountWhatLiesOnSurfacesAndWhatOfThemIsCovered) {
  const TriangleTree surfaces(WallAtX(3, 1));
  std::vector<SeenSample> seen;
  EvaluatedCloud cloud;
  for (int y = -20; y < 20; ++y) {
    for (int z = -20; z < 20; ++z) {
      const Eigen::Vector3d p(3, 0.05 * y + 0.025, 0.05 * z + 0.025);
      seen.push_back({p, y < 0 ? 3.0 : 6.0});
      if (z < 0) continue;  // half of it is mapped, with a fifth 7 cm off
      cloud.points.emplace_back(p + Eigen::Vector3d(z % 5 == 0 ? 0.07 : 0.01, 0, 0));
      cloud.sources.push_back(z % 5 == 0 ? 1 : 0);
    }
  }
  const CloudMetrics metrics = EvaluateCloud(surfaces, seen, cloud);
  EXPECT_EQ(metrics.points, 800);
  EXPECT_EQ(metrics.filled, 160);
  const CloudScore& at_5cm = metrics.scores[1];
  EXPECT_EQ(at_5cm.tolerance_m, 0.05);
  EXPECT_NEAR(at_5cm.accuracy, 0.8, 1e-9);
  EXPECT_EQ(at_5cm.filled_accuracy, 0);
  const CloudScore& at_10cm = metrics.scores[2];
  EXPECT_EQ(at_10cm.accuracy, 1);
  EXPECT_EQ(at_10cm.filled_accuracy, 1);
  for (const double completeness : at_10cm.completeness) EXPECT_NEAR(completeness, 0.53, 0.03);
  EXPECT_NEAR(at_10cm.f[0], 2 * at_10cm.completeness[0] / (1 + at_10cm.completeness[0]), 1e-9);
}

TEST(CloudMetrics, TellWhatWasFilledThoughItWasNotSeen) {
  const TriangleTree surfaces(WallAtX(3, 1));
  EvaluatedCloud cloud;
  std::vector<SeenSample> seen;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d p(3, 0.05 * i - 0.975, 0);
    cloud.points.push_back(p);
    cloud.sources.push_back(i % 2);
    if (i < 10) seen.push_back({p, 3});
  }
  const CloudMetrics metrics = EvaluateCloud(surfaces, seen, cloud);
  EXPECT_EQ(metrics.scores[1].filled_accuracy, 1);
  EXPECT_NEAR(metrics.filled_seen, 6.0 / 20, 1e-9);  // one more is 10 cm from the last sample
  // An empty cloud has no accuracy and covers nothing.
  const CloudMetrics empty = EvaluateCloud(surfaces, {{{3, 0, 0}, 3}}, {});
  EXPECT_EQ(empty.points, 0);
  for (const CloudScore& score : empty.scores) {
    EXPECT_TRUE(std::isnan(score.accuracy));
    EXPECT_EQ(score.f[0], 0);
  }
}

// A map of the space before the wall at 3 m, known up to `known_y_m`.
OccupancyMap MapBeforeWall(double known_y_m, double wall_x_m) {
  OccupancyMap map(0.1);
  CellObservation cells;
  for (int x = -1; x < 40; ++x) {
    for (int y = -25; y < static_cast<int>(std::lround(known_y_m / 0.1)); ++y) {
      for (int z = -25; z < 25; ++z) {
        const double x_m = 0.1 * x + 0.05;
        if (std::abs(x_m - wall_x_m) < 0.1) cells.occupied.emplace_back(x, y, z);
        if (x_m < wall_x_m - 0.1) cells.free.emplace_back(x, y, z);
      }
    }
  }
  map.Update(cells);
  map.Finish();
  return map;
}

TEST(OccupancyMetrics, TellMapsThatKnowHalfOrAreFreeBehindTheWall) {
  const TriangleTree surfaces(WallAtX(3, 2));
  const std::vector<ReferenceView> views = ReferenceViews(surfaces, Standing(2), ForwardRig(), {});
  const auto measure = [&](double known_y_m, double wall_x_m) {
    return EvaluateOccupancy(surfaces, views, MapBeforeWall(known_y_m, wall_x_m), {});
  };
  const OccupancyMetrics perfect = measure(2.5, 3), half = measure(0, 3),
                         behind = measure(2.5, 3.8);
  EXPECT_GT(perfect.rays, 100);
  EXPECT_EQ(perfect.ends_occupied, 1);
  EXPECT_EQ(perfect.passages_known, 1);
  EXPECT_EQ(perfect.passages_free, 1);
  EXPECT_GT(perfect.behind, 100);
  EXPECT_EQ(perfect.behind_called_free, 0);
  EXPECT_NEAR(half.ends_occupied, 0.5, 0.1);
  EXPECT_NEAR(half.passages_known, 0.5, 0.1);
  EXPECT_EQ(half.passages_free, 1);
  EXPECT_EQ(behind.ends_occupied, 0);
  EXPECT_GT(behind.behind_called_free, 0.9);
}

TEST(SurfaceReport, ReadsFilesAndTellsOfBoth) {
  const testing::TempFolder folder;
  SurfaceInputs inputs{folder.Path("surfaces.ply"), folder.Path("rig.yaml"),
                       folder.Path("cloud.ply"), folder.Path("occupancy.bt")};
  PlyElement corners{"vertex", {}}, points{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) {
    corners.Add(name, PlyType::kFloat);
    points.Add(name, PlyType::kFloat);
  }
  points.AppendRow({3, 0, 0});
  for (const Triangle& triangle : WallAtX(3, 2)) {
    for (const Eigen::Vector3d& p : triangle) corners.AppendRow({p.x(), p.y(), p.z()});
  }
  WritePly(inputs.true_surfaces, {{}, {corners}, {{0, 1, 2}, {3, 4, 5}}});
  WritePly(inputs.cloud, {{}, {points}, {}});
  MapBeforeWall(2.5, 3).Write(inputs.occupancy);
  Rig rig = ForwardRig();
  rig.T_imu_camera[1].translation = {0, -0.1, 0};
  WriteKalibrCalibration(inputs.rig, rig);
  const SurfaceMetrics metrics = EvaluateSurfaces(inputs, Standing(1), {}, {});
  ASSERT_TRUE(metrics.cloud && metrics.occupancy);
  EXPECT_EQ(metrics.cloud->scores[0].accuracy, 1);
  const auto json = SurfaceJson(inputs, metrics);
  EXPECT_EQ(json["cloud"]["points"], 1);
  EXPECT_EQ(json["occupancy"]["behind_called_free"], 0);
}

TEST(SurfaceReport, OfNothingThereAreNoFigures) {
  const TriangleTree surfaces(WallAtX(3, 1));
  SurfaceMetrics metrics;
  metrics.cloud = EvaluateCloud(surfaces, {}, {});
  metrics.occupancy = EvaluateOccupancy(surfaces, {}, OccupancyMap(0.1), {});
  const nlohmann::ordered_json json = SurfaceJson({}, metrics);
  const auto& score = json["cloud"]["scores"][0];
  for (const char* key : {"rms_m", "filled_seen"}) {
    EXPECT_EQ(json["cloud"].at(key).dump(), "null") << key;
  }
  EXPECT_EQ(score.at("accuracy").dump(), "null");
  for (const char* key : {"completeness", "f"}) {
    EXPECT_EQ(score["ranges"][0].at(key).dump(), "null") << key;
  }
  for (const char* key : {"ends_occupied", "ends_occupied_nearby", "passages_known",
                          "passages_free", "behind_called_free"}) {
    EXPECT_EQ(json["occupancy"].at(key).dump(), "null") << key;
  }
  EXPECT_NE(FiguresText(json).find("cloud rms_m" + std::string(16, ' ') + "-"), std::string::npos)
      << FiguresText(json);
}

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
  // No further than asked.
  const Eigen::Vector3d origin(5.3, 5.4, 3), down = -Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(tree.FirstHit_m(origin, down), 3, 0.06);
  EXPECT_FALSE(std::isfinite(tree.FirstHit_m(origin, down, 2.5)));
  EXPECT_FALSE(std::isfinite(tree.FirstHit_m(origin, -down)));
  EXPECT_FALSE(std::isfinite(TriangleTree({}).FirstHit_m({0, 0, 0}, {1, 0, 0})));
}

TEST(TriangleTree, MeasuresDistancesToFacesEdgesAndCorners) {
  const TriangleTree one({Triangle{Eigen::Vector3d(0, 0, 0), {2, 0, 0}, {0, 2, 0}}});
  EXPECT_NEAR(one.Distance_m({0.5, 0.5, -0.3}, 10), 0.3, 1e-12);
  EXPECT_NEAR(one.Distance_m({1, -0.4, 0.3}, 10), 0.5, 1e-12);
  EXPECT_NEAR(one.Distance_m({-3, -4, 0}, 10), 5, 1e-12);
  EXPECT_NEAR(one.Distance_m({2, 2, 0}, 10), std::sqrt(2), 1e-12);
  EXPECT_EQ(one.Distance_m({0, 0, 20}, 10), 10);
  EXPECT_EQ(TriangleTree({}).Distance_m({0, 0, 0}, 3), 3);
  // The least of many.
  const std::vector<Triangle> triangles = Floor();
  const TriangleTree tree(triangles);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2, 22), height(-1, 1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p(place(random), place(random), height(random));
    const double expected =
        LeastOfEach(triangles, [&](const TriangleTree& each) { return each.Distance_m(p, 100); });
    EXPECT_NEAR(tree.Distance_m(p, 100), expected, 1e-12);
  }
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
