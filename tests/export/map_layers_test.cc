#include "export/scene/map_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/made_building.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;

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
