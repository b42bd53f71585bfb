// Writes what shows the walls of one small building, for same_walls.py: the page (without its
// scripts), plans as SVG and DXF, IFC and OBJ.
//
//   write_walls FOLDER
#include <Eigen/Geometry>
#include <cstdio>
#include <exception>

#include "data/io/file.h"
#include "export/export.h"
#include "export/web/page_writer.h"
#include "tests/testing/made_building.h"

namespace {

using slcmap::Building;
using slcmap::BuildingPlane;
using slcmap::PlanWall;

// What was measured of a wall, seen from before its face.
BuildingPlane MakeFace(const PlanWall& wall, const Building& building) {
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  BuildingPlane plane;
  plane.id = static_cast<int64_t>(building.planes.size());
  plane.kind = slcmap::PlaneKind::kWall;
  plane.normal = {along.y(), -along.x(), 0};
  plane.offset_m = plane.normal.head<2>().dot(wall.start);
  const auto at = [](const Eigen::Vector2d& p, double z) {
    return Eigen::Vector3d(p.x(), p.y(), z);
  };
  plane.outline_world = {at(wall.start, 0), at(wall.end, 0), at(wall.end, 2.5),
                         at(wall.start, 2.5)};
  return plane;
}

// A room that is turned, and a wall that stands in it by itself, with a passage.
slcmap::MapResult MakeMap() {
  constexpr double kTurn_rad = 0.2;
  slcmap::MapResult map;
  map.id = "0123456789abcdef";
  map.complete = true;
  Building& building = map.building;
  building.storeys = {{0, 0, 2.5}};
  slcmap::testing::AddRoom({0, 0}, {8, 6}, kTurn_rad, 0, &building);
  const Eigen::Rotation2Dd turn(kTurn_rad);
  PlanWall wall;
  wall.id = 4;
  wall.start = turn * Eigen::Vector2d(3, 1);
  wall.end = turn * Eigen::Vector2d(3, 5);
  wall.thickness_m = 0.12;
  wall.openings = {{slcmap::OpeningKind::kPassage, false, 1, 2, 0, 2.5}};
  building.walls.push_back(wall);
  for (PlanWall& each : building.walls) {
    building.planes.push_back(MakeFace(each, building));
    each.plane_ids = {building.planes.back().id};
  }
  return map;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "write_walls FOLDER\n");
    return 2;
  }
  try {
    const std::string folder = argv[1];
    const slcmap::MapResult map = MakeMap();
    slcmap::ExportOptions options;
    options.formats = {"svg", "dxf", "ifc", "obj"};
    slcmap::ExportMap(map, folder + "/export", options);
    slcmap::WriteFile(folder + "/page.txt", slcmap::MakePage(map, "@SLCMAP_MAP@", {}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
