// A cloud and an occupancy map of a room of which everything is known.
#include "apps/evaluation/surface_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "data/calibration/calibration.h"
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
  const CloudMetricOptions options;
  const CloudMetrics metrics = EvaluateCloud(surfaces, seen, cloud, options);
  EXPECT_EQ(metrics.points, 800);
  EXPECT_EQ(metrics.filled, 160);
  EXPECT_EQ(metrics.seen_samples, (std::vector<int64_t>{800, 1600}));
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
  const CloudMetrics metrics = EvaluateCloud(surfaces, seen, cloud, {});
  EXPECT_EQ(metrics.scores[1].filled_accuracy, 1);
  EXPECT_NEAR(metrics.filled_seen, 6.0 / 20, 1e-9);  // one more is 10 cm from the last sample
}

TEST(CloudMetrics, AnEmptyCloudHasNoAccuracyAndCoversNothing) {
  const TriangleTree surfaces(WallAtX(3, 1));
  const CloudMetrics metrics = EvaluateCloud(surfaces, {{{3, 0, 0}, 3}}, {}, {});
  EXPECT_EQ(metrics.points, 0);
  for (const CloudScore& score : metrics.scores) {
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

class OccupancyMetricsTest : public ::testing::Test {
 protected:
  OccupancyMetrics Measure(const OccupancyMap& map) const {
    const std::vector<ReferenceView> views =
        ReferenceViews(surfaces_, Standing(2), ForwardRig(), {});
    return EvaluateOccupancy(surfaces_, views, map, {});
  }
  const TriangleTree surfaces_{WallAtX(3, 2)};
};

TEST_F(OccupancyMetricsTest, ArePerfectOfAPerfectMap) {
  const OccupancyMetrics metrics = Measure(MapBeforeWall(2.5, 3));
  EXPECT_GT(metrics.rays, 100);
  EXPECT_EQ(metrics.ends_occupied, 1);
  EXPECT_EQ(metrics.passages_known, 1);
  EXPECT_EQ(metrics.passages_free, 1);
  EXPECT_GT(metrics.behind, 100);
  EXPECT_EQ(metrics.behind_called_free, 0);
}

TEST_F(OccupancyMetricsTest, TellAMapThatKnowsHalf) {
  const OccupancyMetrics metrics = Measure(MapBeforeWall(0, 3));
  EXPECT_NEAR(metrics.ends_occupied, 0.5, 0.1);
  EXPECT_NEAR(metrics.passages_known, 0.5, 0.1);
  EXPECT_EQ(metrics.passages_free, 1);
}

TEST_F(OccupancyMetricsTest, TellAMapThatIsFreeBehindTheWall) {
  const OccupancyMetrics metrics = Measure(MapBeforeWall(2.5, 3.8));
  EXPECT_EQ(metrics.ends_occupied, 0);
  EXPECT_GT(metrics.behind_called_free, 0.9);
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
  const CloudMetricOptions options;
  const SurfaceMetrics metrics = EvaluateSurfaces(inputs, Standing(1), {}, options, {});
  ASSERT_TRUE(metrics.cloud && metrics.occupancy);
  EXPECT_EQ(metrics.cloud->scores[0].accuracy, 1);
  const auto json = SurfaceJson(inputs, metrics, options);
  EXPECT_EQ(json["cloud"]["points"], 1);
  EXPECT_EQ(json["occupancy"]["behind_called_free"], 0);
  EXPECT_NE(SurfaceTable(inputs, metrics, options).find("end cells occupied 100.0 %"),
            std::string::npos);
}

TEST(SurfaceReport, OfNothingThereAreNoFigures) {
  const TriangleTree surfaces(WallAtX(3, 1));
  SurfaceMetrics metrics;
  metrics.cloud = EvaluateCloud(surfaces, {}, {}, {});
  metrics.occupancy = EvaluateOccupancy(surfaces, {}, OccupancyMap(0.1), {});
  const nlohmann::ordered_json json = SurfaceJson({}, metrics, {});
  EXPECT_EQ(json["cloud"]["rms_m"].dump(), "null");
  EXPECT_EQ(json["cloud"]["filled_seen"].dump(), "null");
  EXPECT_EQ(json["cloud"]["scores"][0]["accuracy"].dump(), "null");
  EXPECT_EQ(json["cloud"]["scores"][0]["ranges"][0]["completeness"].dump(), "null");
  EXPECT_EQ(json["cloud"]["scores"][0]["ranges"][0]["f"].dump(), "null");
  for (const char* key : {"ends_occupied", "ends_occupied_nearby", "passages_known",
                          "passages_free", "behind_called_free"}) {
    EXPECT_EQ(json["occupancy"].at(key).dump(), "null") << key;
  }
  const std::string table = SurfaceTable({}, metrics, {});
  EXPECT_NE(table.find("0 points, 0 of them filled, - m RMS"), std::string::npos) << table;
  EXPECT_NE(table.find("end cells occupied - %"), std::string::npos) << table;
}

}  // namespace
}  // namespace slcmap
