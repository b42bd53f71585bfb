#include <gtest/gtest.h>

#include <map>

#include "export/scene/meshes.h"
#include "tests/testing/hand_made_building.h"

namespace slcmap {
namespace {

// Of a closed solid whose triangles are counter-clockwise seen from outside.
double VolumeAroundOrigin(const MeshLayer& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const auto& p = mesh.vertices.positions;
    volume += p[t[0]].dot(p[t[1]].cross(p[t[2]])) / 6;
  }
  return volume;
}

Eigen::Vector3d SumOfAreas(const MeshLayer& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
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
    AddWallMesh(building.walls[i], HeightOfWall(building.walls[i], building, 2.5), {}, &mesh);
    EXPECT_NEAR(VolumeAroundOrigin(mesh), expected_m3[i], 1e-9) << i;
    EXPECT_LT(SumOfAreas(mesh).norm(), 1e-9) << i;
  }
}

TEST(SurfaceMeshTest, WallsAreBehindTheirFace) {
  const Building building = testing::MakeTwoStoreys().building;
  MeshLayer mesh;
  AddWallMesh(building.walls[1], HeightOfWall(building.walls[1], building, 2.5), {}, &mesh);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : mesh.vertices.positions) box.extend(p);
  EXPECT_LT((box.min() - Eigen::Vector3d(-0.1, 0, -0.5)).norm(), 1e-12);
  EXPECT_LT((box.max() - Eigen::Vector3d(0, 6, 2.2)).norm(), 1e-12);
}

TEST(SurfaceMeshTest, PlanesLookToWhereTheyWereSeenFrom) {
  const Building building = testing::MakeTwoStoreys().building;
  for (const BuildingPlane& plane : building.planes) {
    MeshLayer mesh;
    AddPlaneMesh(plane, building, {}, &mesh);
    EXPECT_LT((SumOfAreas(mesh) - 47 * plane.normal).norm(), 1e-9) << plane.id;
    for (const Eigen::Vector3d& p : mesh.vertices.positions) {
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
