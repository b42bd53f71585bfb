#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <sstream>

#include "data/io/file.h"
#include "export/export.h"
#include "export/scene/building_solids.h"
#include "export/scene/meshes.h"
#include "mapping/map/part_files.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/made_building.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Box = Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurn_rad = 0.3, kRun_rad = 0.1, kFrameNear_m = 1e-4;

// A room whose walls are turned in the map's world; the plan has its second heading along x. The
// face of its first wall is among the planes.
MapResult MakeTurnedMap() {
  MapResult map;
  map.building = testing::MakeBuilding(1, kTurn_rad);
  map.building.T_map_world.rotation = ExpRotation({0, 0, -kTurn_rad - 0.5 * M_PI});
  map.source.T_world_run.rotation = ExpRotation({0, 0, kRun_rad});
  const PlanWall& wall = map.building.walls[0];
  BuildingPlane face;
  face.kind = PlaneKind::kWall;
  const Vector2d along = (wall.end - wall.start).normalized();
  face.normal = {along.y(), -along.x(), 0};
  for (const double z_m : {0.0, 2.5}) {
    for (const Vector2d& p : {wall.start, wall.end}) {
      face.outline_world.emplace_back(p.x(), p.y(), z_m);
    }
  }
  std::swap(face.outline_world[2], face.outline_world[3]);
  face.offset_m = face.normal.dot(face.outline_world[0]);
  map.building.planes = {face};
  return map;
}

// Of the first wall along the building: its face, and the wall with corners that it shares.
Box ExpectedFace() { return {Vector3d(0, 0, 0), Vector3d(4, 0, 2.5)}; }
Box ExpectedWall() { return {Vector3d(-0.2, -0.2, 0), Vector3d(4.2, 0, 2.5)}; }

void ExpectNear(const Box& found, const Box& expected) {
  EXPECT_LT((found.min() - expected.min()).norm(), kFrameNear_m) << found.min().transpose();
  EXPECT_LT((found.max() - expected.max()).norm(), kFrameNear_m) << found.max().transpose();
}

// The values of a group code in the entities of a layer.
std::vector<double> DxfValues(const std::string& text, const std::string& layer, int code) {
  std::istringstream rows(text.substr(text.find("ENTITIES")));
  std::vector<double> values;
  std::string group, value, of;
  std::getline(rows, value);
  while (std::getline(rows, group) && std::getline(rows, value)) {
    if (group == "8") of = value;
    if (group == std::to_string(code) && of == layer) values.push_back(std::stod(value));
  }
  return values;
}

Box BoxInObj(const std::string& text, const std::string& object) {
  std::istringstream rows(text.substr(text.find("o " + object + "\n") + 2));
  Box box;
  for (std::string row; std::getline(rows, row) && !row.starts_with("o ");) {
    std::istringstream values(row);
    char kind = 0;
    Vector3d p;
    if (values >> kind >> p.x() >> p.y() >> p.z() && kind == 'v') box.extend(p);
  }
  return box;
}

Box BoxInGltf(const std::string& path, const std::string& mesh) {
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, path));
  for (const tinygltf::Mesh& found : model.meshes) {
    if (found.name != mesh) continue;
    const int accessor = found.primitives[0].attributes.at("POSITION");
    const auto& values = model.accessors[static_cast<std::size_t>(accessor)];
    return {Vector3d(values.minValues.data()), Vector3d(values.maxValues.data())};
  }
  return {};
}

class BuildingFrameTest : public ::testing::Test {
 protected:
  BuildingFrameTest() { ExportMap(map_, folder_, {}); }
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  const MapResult map_ = MakeTurnedMap();
  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("export");
};

TEST_F(BuildingFrameTest, DrawingsObjectsAndScenesHaveTheWallAtOnePlace) {
  const std::string obj = ReadFile(Path("map.obj"));
  ExpectNear(BoxInObj(obj, "S0_WALL_PLANE"), ExpectedFace());
  const std::string plan = ReadFile(Path("plan.dxf")), map = ReadFile(Path("map.dxf"));
  // Corners of walls in the plan are those of the face, or of the backs beside and behind it.
  for (const int code : {10, 20, 11, 21}) {
    const bool is_x = code % 20 < 10 || code < 20;
    for (const double value : DxfValues(plan, "S0_WALL", code)) {
      const Vector2d corners = is_x ? Vector2d(0, 4) : Vector2d(0, 3);
      const bool is_corner = (corners.array() - value).abs().minCoeff() < kFrameNear_m ||
                             std::abs(value - corners[0] + 0.2) < kFrameNear_m ||
                             std::abs(value - corners[1] - 0.2) < kFrameNear_m;
      // Else it is the side of an opening, which is along the wall.
      EXPECT_TRUE(is_corner || (value > 0 && value < corners[1])) << code << " " << value;
    }
  }
  Box face;
  for (const int k : {10, 11, 12}) {
    const auto x = DxfValues(map, "S0_WALL_PLANE", k), y = DxfValues(map, "S0_WALL_PLANE", k + 10),
               z = DxfValues(map, "S0_WALL_PLANE", k + 20);
    ASSERT_FALSE(x.empty());
    for (std::size_t i = 0; i < x.size(); ++i) face.extend(Vector3d(x[i], y[i], z[i]));
  }
  ExpectNear(face, ExpectedFace());
  ExpectNear(BoxInGltf(Path("scene.glb"), "walls/storey 0/wall 0"), ExpectedWall());
  // The summary says how the run is turned.
  EXPECT_NEAR(YawOfWorld(ExportSourceIn(folder_).T_world_run), kRun_rad - kTurn_rad, 1e-9);
  EXPECT_THAT(ReadFile(Path("export.json")), ::testing::HasSubstr("\"map_yaw_rad\": -0.3"));
}

TEST_F(BuildingFrameTest, IfcHasTheWallThereToo) {
  if (!testing::HasNodeReader("web-ifc")) GTEST_SKIP() << testing::NodeReaderMissing("web-ifc");
  const auto walls =
      testing::IfcProducts(testing::RunNodeReader("read_ifc.mjs", Path("map.ifc")).text, "IfcWall");
  ASSERT_FALSE(walls.empty());
  ExpectNear({walls[0].low, walls[0].high}, ExpectedWall());
}

TEST(BuildingFrame, OccupiedSpaceTurnsWithTheRest) {
  MapResult map = MakeTurnedMap();
  CellObservation cells;
  for (int x = 20; x < 40; ++x) {
    for (int y = 10; y < 20; ++y) {
      for (int z = 0; z < 12; ++z) {
        (y < 15 ? cells.free : cells.occupied).emplace_back(x, y, z);
      }
    }
  }
  map.occupancy.Mark(cells);
  map.occupancy.Finish();
  const RigidTransform T = FrameOfExports(map);
  const MapResult turned = InFrameOfExports(map, {});
  double occupied_m3 = 0;
  for (const Voxel& voxel : turned.occupancy.OccupiedVoxels()) {
    occupied_m3 += std::pow(voxel.size_m, 3);
    EXPECT_TRUE(map.occupancy.IsOccupied(T.Inverse() * voxel.centre_world) || voxel.size_m > 0.11);
  }
  EXPECT_NEAR(occupied_m3, 20 * 5 * 12 * 1e-3, 0.05);
  EXPECT_TRUE(turned.occupancy.IsFree(T * Vector3d(3, 1.2, 0.5)));
  EXPECT_TRUE(turned.occupancy.IsOccupied(T * Vector3d(3, 1.75, 0.5)));
}

TEST(BuildingFrame, AMapAlongTheBuildingStaysAsItIs) {
  MapResult map = MakeTurnedMap();
  map.building.T_map_world = {};
  EXPECT_TRUE(IsInFrameOfExports(map.building));
  map.building.T_map_world.rotation = ExpRotation({0, 0, 0.5 * M_PI});
  EXPECT_FALSE(IsInFrameOfExports(map.building));
  EXPECT_NEAR(YawOfWorld(FrameOfExports(map)), 0, 1e-12);
}

double TotalArea(const std::vector<Polygon>& areas) {
  double total = 0;
  for (const Polygon& area : areas) total += Area(area);
  return total;
}

// 4 m by 3 m within, 4.4 m by 3.4 m outside, without a door of 0.9 m and a window of 1.2 m.
constexpr double kWalls_m2 = 4.4 * 3.4 - 4 * 3 - 0.2 * (0.9 + 1.2);

TEST(WallSolidsTest, CornersAreClosedAndOpeningsCut) {
  for (const double turn_rad : {0.0, 0.2, -1.3}) {
    const auto areas = WallAreas(WallSolids(testing::MakeBuilding(1, turn_rad), 0));
    EXPECT_NEAR(TotalArea(areas), kWalls_m2, 1e-4) << turn_rad;
    EXPECT_EQ(areas.size(), 2u);  // the door and the window part the ring of walls
  }
  // Walls that overlap are one area.
  Building building = testing::MakeBuilding();
  building.walls[1].openings.clear();
  const double once_m2 = TotalArea(WallAreas(WallSolids(building, 0)));
  building.walls.push_back(building.walls[1]);
  EXPECT_NEAR(TotalArea(WallAreas(WallSolids(building, 0))), once_m2, 1e-9);
}

TEST(WallSolidsTest, OnlyTheBackOfAWallThatWasSeenFromOneSideIsAssumed) {
  double assumed_m = 0, measured_m = 0;
  for (const WallEdge& edge : WallEdges(WallSolids(testing::MakeBuilding(), 0))) {
    (edge.assumed ? assumed_m : measured_m) += (edge.end - edge.start).norm();
  }
  EXPECT_NEAR(assumed_m, 3.4, 1e-4);  // from outer corner to outer corner
  // Within and outside, and the jambs of the openings.
  EXPECT_NEAR(measured_m, 2 * (4 + 3) + 2 * 4.4 + 3.4 - 2 * (0.9 + 1.2) + 4 * 0.2, 1e-4);
}

TEST(WallSolidsTest, WallsThatTurnBackHaveTheirCornersWithin) {
  Building building;
  building.storeys = {{0, 0, {}}};
  PlanWall along, away;  // around the outside of a column's corner
  along.start = {0, 0};
  along.end = {2, 0};
  away.start = {2, 0};
  away.end = {2, 2};
  along.thickness_m = away.thickness_m = 0.2;
  building.walls = {along, away};
  EXPECT_NEAR(TotalArea(WallAreas(WallSolids(building, 0))), 0.2 * 2 + 0.2 * 1.8, 1e-6);
}

TEST(WallSolidsTest, WallsWithoutALengthAndOpeningsBeyondTheEndDoNoHarm) {
  Building building = testing::MakeBuilding();
  building.walls[0].end = building.walls[0].start;
  building.walls[1].openings = {{OpeningKind::kPassage, false, 1, 99, 0, 2}};
  building.walls[2].openings = {{OpeningKind::kPassage, false, 50, 99, 0, 2}};
  EXPECT_EQ(WallSolids(building, 0).size(), 3u);
  EXPECT_GT(TotalArea(WallAreas(WallSolids(building, 0))), 0.5);
}

// Of a closed solid whose triangles are counter-clockwise seen from outside.
double VolumeAroundOrigin(const MeshLayer& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const auto& p = mesh.vertices.positions;
    volume += p[t[0]].dot(p[t[1]].cross(p[t[2]])) / 6;
  }
  return volume;
}

Vector3d SumOfAreas(const MeshLayer& mesh) {
  Vector3d sum = Vector3d::Zero();
  for (const auto& t : mesh.triangles) {
    const auto& p = mesh.vertices.positions;
    sum += 0.5 * (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
  }
  return sum;
}

TEST(SurfaceMeshTest, WallsAreClosedSolidsWithTheirOpeningsCut) {
  const Building building = testing::MakeTwoStoreys().building;
  const double openings_m2 = 0.9 * 2.05 + 1.5 * 1.2 + 1.5 * 2.7;
  const double expected_m3[] = {(8 * 2.7 - openings_m2) * 0.24, 6 * 2.7 * 0.1, 5 * 2.7 * 0.15,
                                4 * 2.5 * 0.2};
  for (std::size_t i = 0; i < building.walls.size(); ++i) {
    MeshLayer mesh;
    AddWallMesh(building.walls[i], HeightOfWall(building.walls[i], building), {}, &mesh);
    EXPECT_NEAR(VolumeAroundOrigin(mesh), expected_m3[i], 1e-9) << i;
    EXPECT_LT(SumOfAreas(mesh).norm(), 1e-9) << i;
    if (i != 1) continue;
    Box box;  // behind its face
    for (const Vector3d& p : mesh.vertices.positions) box.extend(p);
    EXPECT_LT((box.min() - Vector3d(-0.1, 0, -0.5)).norm(), 1e-12);
    EXPECT_LT((box.max() - Vector3d(0, 6, 2.2)).norm(), 1e-12);
  }
}

TEST(SurfaceMeshTest, PlanesLookToWhereTheyWereSeenFrom) {
  const Building building = testing::MakeTwoStoreys().building;
  for (const BuildingPlane& plane : building.planes) {
    MeshLayer mesh;
    AddPlaneMesh(plane, building, {}, &mesh);
    EXPECT_LT((SumOfAreas(mesh) - 47 * plane.normal).norm(), 1e-9) << plane.id;
    for (const Vector3d& p : mesh.vertices.positions) {
      EXPECT_NEAR(plane.normal.dot(p), plane.offset_m, 1e-12);
    }
  }
}

TEST(SurfaceMeshTest, AnUprightPlaneHasItsOpenings) {
  BuildingPlane plane;
  plane.normal = {0, -1, 0};
  plane.offset_m = -6;
  plane.outline_world = {{0, 6, 0}, {8, 6, 0}, {8, 6, 3}, {0, 6, 3}};
  PlaneOpening door;
  door.outline_world = {{1, 6, 0}, {2, 6, 0}, {2, 6, 2}, {1, 6, 2}};
  plane.openings = {door};
  plane.kind = PlaneKind::kWall;
  MeshLayer mesh;
  AddPlaneMesh(plane, {}, {}, &mesh);
  EXPECT_LT((SumOfAreas(mesh) - 22 * plane.normal).norm(), 1e-9);
}

}  // namespace
}  // namespace slcmap
