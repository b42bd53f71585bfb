#include "export/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "data/core/error.h"
#include "export/scene/map_layers.h"
#include "mapping/mapping.h"
#include "tests/testing/made_building.h"
#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;

// By the divergence theorem, which gives that of a closed mesh only when all triangles are turned
// outwards; each is expected to face away from a point inside.
double VolumeOf(const MeshLayer& mesh, const Eigen::Vector3d& inside) {
  double volume_m3 = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto& p = mesh.vertices.positions;
    const double part = (p[a] - inside).dot((p[b] - inside).cross(p[c] - inside)) / 6;
    EXPECT_GT(part, 0);
    volume_m3 += part;
  }
  return volume_m3;
}

MapResult MakeWallMap() { return MapRun(testing::MakeWallRun(), nullptr, {}); }

TEST(MapScene, HasALayerForEachPartOfTheMap) {
  MapResult map = MakeWallMap();
  map.lines.resize(2);
  const MapScene scene = MakeScene(map);
  EXPECT_EQ(scene.points.size(), map.points.size());
  EXPECT_EQ(scene.lines.edges.size(), 2u);
  EXPECT_EQ(scene.trajectory.edges.size(), 50u);
  EXPECT_EQ(scene.keyframes.edges.size(), 6u * 8);
  EXPECT_GT(scene.voxels.triangles.size(), 4 * map.occupancy.OccupiedVoxels().size());
  EXPECT_EQ(MakeScene(MapResult()).CountVertices(), 0);
}

TEST(MapScene, AMapOfTooManyVerticesIsRefusedWithTheirNumber) {
  const MapResult map = MakeWallMap();
  const int vertices = static_cast<int>(MakeScene(map).CountVertices());
  EXPECT_NO_THROW(MakeScene(map, vertices));
  EXPECT_THROW(MakeScene(map, vertices - 1), ConfigError);
  EXPECT_THROW(MakeScene(MapResult(), 0), ConfigError);
}

TEST(MapScene, VoxelsAreClosedAndFaceOutwards) {
  MapResult map;
  map.occupancy = OccupancyMap(0.5);
  map.occupancy.Insert({{{0.25, 0.25, 0.25}, {{5.25, 0.25, 0.25}}}}, 20);
  const MeshLayer voxels = MakeScene(map).voxels;
  ASSERT_EQ(voxels.triangles.size(), 12u);
  EXPECT_NEAR(VolumeOf(voxels, {5.25, 0.25, 0.25}), 0.125, 1e-6);
}

TEST(MapScene, BarsAreClosedAndFaceOutwards) {
  const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines = {
      {{1, 2, 3}, {1, 2, 5}}, {{1, 2, 3}, {3, 2, 3}}, {{1, 2, 3}, {2, 0, 5}}};
  for (const auto& [start, end] : lines) {
    MapResult map;
    map.lines = {{0, 0, LineAxis::kX, 0, 0, true, start, end}};
    const MeshLayer bars = MakeScene(map).line_bars;
    ASSERT_EQ(bars.triangles.size(), 12u);
    EXPECT_NEAR(VolumeOf(bars, (start + end) / 2), 0.0016 * (end - start).norm(), 1e-9);
    EXPECT_EQ(bars.vertices.colours.back().red, LineColour(LineAxis::kX, true)[0]);
    const Eigen::ParametrizedLine<double, 3> line =
        Eigen::ParametrizedLine<double, 3>::Through(start, end);
    for (const Eigen::Vector3d& corner : bars.vertices.positions) {
      EXPECT_NEAR(line.distance(corner), 0.02 * std::sqrt(2), 1e-9);
    }
  }
  MapResult dot;  // without length, and so without a bar
  dot.lines = {{0, 0, LineAxis::kX, 0, 0, true, {1, 2, 3}, {1, 2, 3}}};
  EXPECT_TRUE(MakeScene(dot).line_bars.triangles.empty());
}

TEST(MapScene, FacesBetweenVoxelsAreLeftOut) {
  MapResult map;
  map.occupancy = OccupancyMap(0.5);
  map.occupancy.Insert({{{0.25, 0.25, 0.25}, {{5.25, 0.25, 0.25}, {5.25, 0.75, 0.25}}}}, 20);
  const MeshLayer voxels = MakeScene(map).voxels;
  EXPECT_EQ(voxels.triangles.size(), 2u * 10);
  for (const auto& [a, b, c] : voxels.triangles) {
    const Eigen::Vector3d middle = (voxels.vertices.positions[a] + voxels.vertices.positions[b] +
                                    voxels.vertices.positions[c]) /
                                   3;
    EXPECT_GT(std::abs(middle.y() - 0.5), 0.1);  // where the two meet
  }
}

TEST(MapScene, FrustaLookWhereTheCameraLooks) {
  MapResult map = MakeWallMap();
  map.keyframes.resize(1);
  const Vertices frustum = MakeScene(map).keyframes.vertices;
  const Eigen::Vector3d camera = map.keyframes[0].T_world_imu.translation;
  for (std::size_t i = 0; i < frustum.size(); i += 4) {
    EXPECT_EQ(frustum.positions[i], camera);
    EXPECT_NEAR(frustum.positions[i + 1].x() - camera.x(), 0.2, 1e-9);  // along +x, where it looks
    EXPECT_NEAR(std::abs(frustum.positions[i + 1].y()), 0.2, 1e-9);     // 90 degrees wide
    EXPECT_NEAR(std::abs(frustum.positions[i + 1].z() - 1), 0.15, 1e-9);
  }
}

TEST(MapScene, NearKeyframesAndGapsInTimeAreLeftOut) {
  MapResult map = MakeWallMap();
  StampedPose near = map.keyframes[0];
  near.T_world_imu.translation.x() += 0.4;
  map.keyframes.insert(map.keyframes.begin() + 1, near);
  map.trajectory.erase(map.trajectory.begin() + 20, map.trajectory.begin() + 30);
  const MapScene scene = MakeScene(map);
  EXPECT_EQ(scene.keyframes.edges.size(), 6u * 8);
  EXPECT_EQ(scene.trajectory.edges.size(), 39u);  // 41 poses in two pieces
}

Trajectory Poses(int count, int64_t step_ns) {
  Trajectory poses(count);
  for (int i = 0; i < count; ++i) poses[i].stamp_ns = i * step_ns;
  return poses;
}

TEST(TrajectoryGap, IsHalfASecondWherePosesAreDenseAndLongerWhereTheyAreRare) {
  Trajectory rare = Poses(40, 1'000'000'000);
  EXPECT_EQ(TrajectoryGap_s(Poses(40, 50'000'000)), 0.5);
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(rare), 4);
  rare.back().stamp_ns += 60'000'000'000;  // one long gap is still one
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(rare), 4);
  EXPECT_EQ(TrajectoryGap_s({}), 0.5);
  EXPECT_EQ(TrajectoryGap_s(Poses(1, 1)), 0.5);
}

MapLine LineAt(double height_m, LineAxis axis, LineKind kind) {
  MapLine line;
  line.axis = axis;
  line.kind = kind;
  line.start_world = {0, 0, height_m};
  line.end_world = {1, 0, height_m};
  return line;
}

std::vector<std::string> ListNames(const std::vector<LinesOfLayer>& layers) {
  std::vector<std::string> names;
  for (const LinesOfLayer& layer : layers) names.push_back(layer.name);
  return names;
}

TEST(MapLayersTest, LinesAreByStoreyAxisAndKind) {
  MapResult map;
  map.lines = {LineAt(4, LineAxis::kY, LineKind::kPipe), LineAt(1, LineAxis::kX, LineKind::kEdge),
               LineAt(2, LineAxis::kX, LineKind::kEdge)};
  map.marks = {LineAt(1, LineAxis::kNone, LineKind::kUnknown)};
  EXPECT_THAT(ListNames(LineLayers(map)), ElementsAre("X_EDGE", "Y_PIPE", "OTHER_MARK"));
  map.building = testing::MakeBuilding(2);
  const std::vector<LinesOfLayer> layers = LineLayers(map);
  EXPECT_THAT(ListNames(layers), ElementsAre("S0_X_EDGE", "S0_OTHER_MARK", "S1_Y_PIPE"));
  EXPECT_EQ(layers[0].lines.size(), 2u);
}

TEST(MapLayersTest, AxesOfPipesAreLinesOfTheirKind) {
  MapResult map;
  map.building = testing::MakeBuilding(2);
  MapPipe pipe;
  pipe.axis = LineAxis::kVertical;
  pipe.start_world = {1, 2, 0.2};
  pipe.end_world = {1, 2, 2};
  map.pipes = {pipe};
  const std::vector<LinesOfLayer> layers = LineLayers(map);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].name, "S0_VERTICAL_PIPE");
  EXPECT_EQ(layers[0].lines[0][1], Eigen::Vector3d(1, 2, 2));
}

TEST(MapLayersTest, TrianglesLookToWhereThePlaneWasSeenFrom) {
  Building building = testing::MakeBuilding();
  BuildingPlane plane;
  plane.kind = PlaneKind::kCeiling;
  plane.normal = {0, 0, -1};
  plane.outline_world = {{0, 0, 2}, {2, 0, 2}, {2, 1, 2}, {1, 1, 2}, {1, 2, 2}, {0, 2, 2}};
  building.planes = {plane};
  const std::vector<PlanesOfLayer> layers = PlaneLayers(building);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].name, "S0_CEILING_PLANE");
  double area_m2 = 0;
  for (const auto& [a, b, c] : layers[0].triangles) {
    area_m2 += 0.5 * (b - a).cross(c - a).dot(plane.normal);
  }
  EXPECT_NEAR(area_m2, 3, 1e-4);
}

}  // namespace
}  // namespace slcmap
