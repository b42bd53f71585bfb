#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <sstream>

#include "data/io/file.h"
#include "export/export.h"
#include "mapping/map/part_files.h"
#include "tests/testing/made_building.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Box = Eigen::AlignedBox3d;

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
  const auto x = DxfValues(map, "S0_WALL_PLANE", 10), y = DxfValues(map, "S0_WALL_PLANE", 20),
             z = DxfValues(map, "S0_WALL_PLANE", 30);
  ASSERT_FALSE(x.empty());
  for (std::size_t i = 0; i < x.size(); ++i) face.extend(Vector3d(x[i], y[i], z[i]));
  for (const int k : {11, 12}) {
    const auto more_x = DxfValues(map, "S0_WALL_PLANE", k),
               more_y = DxfValues(map, "S0_WALL_PLANE", k + 10),
               more_z = DxfValues(map, "S0_WALL_PLANE", k + 20);
    for (std::size_t i = 0; i < more_x.size(); ++i) {
      face.extend(Vector3d(more_x[i], more_y[i], more_z[i]));
    }
  }
  ExpectNear(face, ExpectedFace());
  ExpectNear(BoxInGltf(Path("scene.glb"), "walls/storey 0/wall 0"), ExpectedWall());
}

TEST_F(BuildingFrameTest, IfcHasTheWallThereToo) {
  if (!testing::HasNodeReader("web-ifc")) GTEST_SKIP() << testing::NodeReaderMissing("web-ifc");
  std::istringstream rows(testing::RunNodeReader("read_ifc.mjs", Path("map.ifc")).text);
  for (std::string row; std::getline(rows, row);) {
    std::istringstream values(row);
    std::string word, type, guid;
    double triangles = 0, volume_m3 = 0;
    Vector3d low, high;
    values >> word >> type >> guid >> triangles >> volume_m3 >> low.x() >> low.y() >> low.z() >>
        high.x() >> high.y() >> high.z();
    if (!values || type != "IfcWall") continue;
    ExpectNear({low, high}, ExpectedWall());
    return;
  }
  FAIL() << "no wall";
}

TEST_F(BuildingFrameTest, TheSummarySaysHowTheRunIsTurned) {
  EXPECT_NEAR(YawOfWorld(ExportSourceIn(folder_).T_world_run), kRun_rad - kTurn_rad, 1e-9);
  EXPECT_THAT(ReadFile(Path("export.json")), ::testing::HasSubstr("\"map_yaw_rad\": -0.3"));
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

}  // namespace
}  // namespace slcmap
