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
  const MapScene scene = MakeScene(map, {});
  EXPECT_EQ(scene.points[0].vertices.size(), map.points.size());
  EXPECT_EQ(scene.lines[0].name, "lines");
  EXPECT_EQ(scene.lines[0].edges.size(), 2u);
  EXPECT_EQ(scene.lines[1].name, "trajectory");
  EXPECT_EQ(scene.lines[1].edges.size(), 50u);
  EXPECT_EQ(scene.lines[2].name, "keyframes");
  EXPECT_EQ(scene.lines[2].edges.size(), 6u * 8);
  EXPECT_GT(scene.meshes[0].triangles.size(), 4 * map.occupancy.OccupiedVoxels().size());
  const MapScene empty = MakeScene(MapResult(), {});
  for (const PointLayer& layer : empty.points) EXPECT_EQ(layer.vertices.size(), 0u);
  for (const LineLayer& layer : empty.lines) EXPECT_TRUE(layer.edges.empty());
  for (const MeshLayer& layer : empty.meshes) EXPECT_TRUE(layer.triangles.empty());
}

TEST(MapScene, AMapOfTooManyVerticesIsRefusedWithTheirNumber) {
  const MapResult map = MakeWallMap();
  int64_t vertices = 0;
  const MapScene scene = MakeScene(map, {});
  for (const PointLayer& layer : scene.points) vertices += layer.vertices.size();
  for (const LineLayer& layer : scene.lines) vertices += layer.vertices.size();
  for (const MeshLayer& layer : scene.meshes) vertices += layer.vertices.size();
  SceneOptions options;
  options.max_vertices = static_cast<int>(vertices);
  EXPECT_NO_THROW(MakeScene(map, options));
  options.max_vertices -= 1;
  EXPECT_THROW(MakeScene(map, options), ConfigError);
  EXPECT_THROW(MakeScene(map, {.frustum_m = 0}), ConfigError);
  EXPECT_THROW(MakeScene(map, {.line_bar_m = 0}), ConfigError);
}

TEST(MapScene, VoxelsAreClosedAndFaceOutwards) {
  MapResult map;
  map.occupancy = OccupancyMap(0.5);
  map.occupancy.Insert({{{0.25, 0.25, 0.25}, {{5.25, 0.25, 0.25}}}}, 20);
  const MeshLayer voxels = MakeScene(map, {}).meshes[0];
  ASSERT_EQ(voxels.triangles.size(), 12u);
  EXPECT_NEAR(VolumeOf(voxels, {5.25, 0.25, 0.25}), 0.125, 1e-6);
}

TEST(MapScene, BarsAreClosedAndFaceOutwards) {
  const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines = {
      {{1, 2, 3}, {1, 2, 5}}, {{1, 2, 3}, {3, 2, 3}}, {{1, 2, 3}, {2, 0, 5}}};
  for (const auto& [start, end] : lines) {
    MapResult map;
    map.lines = {{0, 0, LineAxis::kX, 0, 0, true, start, end}};
    SceneOptions options;
    options.line_bar_m = 0.5;
    const MeshLayer bars = MakeScene(map, options).meshes[1];
    ASSERT_EQ(bars.triangles.size(), 12u);
    EXPECT_NEAR(VolumeOf(bars, (start + end) / 2), 0.25 * (end - start).norm(), 1e-9);
    EXPECT_EQ(bars.vertices.colours.back().red, LineColour(LineAxis::kX, true)[0]);
    const Eigen::ParametrizedLine<double, 3> line =
        Eigen::ParametrizedLine<double, 3>::Through(start, end);
    for (const Eigen::Vector3d& corner : bars.vertices.positions) {
      EXPECT_NEAR(line.distance(corner), 0.25 * std::sqrt(2), 1e-9);
    }
  }
  MapResult dot;  // without length, and so without a bar
  dot.lines = {{0, 0, LineAxis::kX, 0, 0, true, {1, 2, 3}, {1, 2, 3}}};
  EXPECT_TRUE(MakeScene(dot, {}).meshes[1].triangles.empty());
}

TEST(MapScene, FacesBetweenVoxelsAreLeftOut) {
  MapResult map;
  map.occupancy = OccupancyMap(0.5);
  map.occupancy.Insert({{{0.25, 0.25, 0.25}, {{5.25, 0.25, 0.25}, {5.25, 0.75, 0.25}}}}, 20);
  const MeshLayer voxels = MakeScene(map, {}).meshes[0];
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
  SceneOptions options;
  options.frustum_m = 2;
  const Vertices frustum = MakeScene(map, options).lines[2].vertices;
  const Eigen::Vector3d camera = map.keyframes[0].T_world_imu.translation;
  for (std::size_t i = 0; i < frustum.size(); i += 4) {
    EXPECT_EQ(frustum.positions[i], camera);
    EXPECT_NEAR(frustum.positions[i + 1].x() - camera.x(), 2, 1e-9);  // along +x, where it looks
    EXPECT_NEAR(std::abs(frustum.positions[i + 1].y()), 2, 1e-9);     // 90 degrees wide
    EXPECT_NEAR(std::abs(frustum.positions[i + 1].z() - 1), 1.5, 1e-9);
  }
}

TEST(MapScene, NearKeyframesAndGapsInTimeAreLeftOut) {
  MapResult map = MakeWallMap();
  SceneOptions options;
  options.frustum_spacing_m = 1.5;
  map.trajectory.erase(map.trajectory.begin() + 20, map.trajectory.begin() + 30);
  const MapScene scene = MakeScene(map, options);
  EXPECT_EQ(scene.lines[2].edges.size(), 3u * 8);  // at 0, 2 and 4 m
  EXPECT_EQ(scene.lines[1].edges.size(), 39u);     // 41 poses in two pieces
}

Trajectory Poses(int count, int64_t step_ns) {
  Trajectory poses(count);
  for (int i = 0; i < count; ++i) poses[i].stamp_ns = i * step_ns;
  return poses;
}

TEST(TrajectoryGap, IsAsGivenWherePosesAreDenseAndLongerWhereTheyAreRare) {
  Trajectory rare = Poses(40, 1'000'000'000);
  EXPECT_EQ(TrajectoryGap_s(Poses(40, 50'000'000), 0.5), 0.5);
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(rare, 0.5), 4);
  rare.back().stamp_ns += 60'000'000'000;  // one long gap is still one
  EXPECT_DOUBLE_EQ(TrajectoryGap_s(rare, 0.5), 4);
  EXPECT_EQ(TrajectoryGap_s({}, 0.5), 0.5);
  EXPECT_EQ(TrajectoryGap_s(Poses(1, 1), 0.5), 0.5);
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
