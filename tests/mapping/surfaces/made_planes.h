// Planes for tests: the corner of a room with what was measured of it, a wall with a door, a grid.
#pragma once

#include <vector>

#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/surfaces/bounded_plane.h"

namespace slcmap::testing {

inline BuildingPlane MakePlane(PlaneKind kind, const Eigen::Vector3d& normal,
                               const std::vector<Eigen::Vector3d>& outline) {
  BuildingPlane plane;
  plane.kind = kind;
  plane.normal = normal;
  plane.offset_m = normal.dot(outline.front());
  plane.sigma_m = 0.006;
  plane.outline_world = outline;
  return plane;
}

// The wall y = 0, seen from y > 0, and the floor z = 0, both from x = 0 to 4.
inline Building WallAndFloor() {
  Building building;
  building.planes = {MakePlane(PlaneKind::kWall, Eigen::Vector3d::UnitY(),
                               {{0, 0, 0}, {4, 0, 0}, {4, 0, 2.5}, {0, 0, 2.5}}),
                     MakePlane(PlaneKind::kFloor, Eigen::Vector3d::UnitZ(),
                               {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}})};
  for (size_t i = 0; i < building.planes.size(); ++i) {
    building.planes[i].id = static_cast<int64_t>(i);
  }
  return building;
}

struct Measured {
  double from_m = 0, to_m = 0;
};

// Points every 4 cm, of the wall or of the floor: along x, and away from the corner.
inline void AddWall(const Measured& x, const Measured& z, double y_m,
                    std::vector<DensePoint>* cloud) {
  for (double px = x.from_m; px < x.to_m; px += 0.04) {
    for (double pz = z.from_m; pz < z.to_m; pz += 0.04) {
      cloud->push_back({{px, y_m, pz}, Eigen::Vector3d::UnitY(), 0.005, 100});
    }
  }
}

inline void AddFloor(const Measured& x, const Measured& y, double z_m,
                     std::vector<DensePoint>* cloud) {
  for (double px = x.from_m; px < x.to_m; px += 0.04) {
    for (double py = y.from_m; py < y.to_m; py += 0.04) {
      cloud->push_back({{px, py, z_m}, Eigen::Vector3d::UnitZ(), 0.005, 100});
    }
  }
}

// y = 3, seen from y = 0, 4 m long and 2.5 m high, with a door 2 m high from x = 1 to 2.
inline Building WallWithDoor(double sigma_m) {
  BuildingPlane wall;
  wall.kind = PlaneKind::kWall;
  wall.normal = -Eigen::Vector3d::UnitY();
  wall.offset_m = -3;
  wall.sigma_m = sigma_m;
  wall.outline_world = {{0, 3, 0}, {4, 3, 0}, {4, 3, 2.5}, {0, 3, 2.5}};
  PlaneOpening door;
  door.outline_world = {{1, 3, 0}, {2, 3, 0}, {2, 3, 2}, {1, 3, 2}};
  wall.openings = {door};
  Building building;
  building.planes = {wall};
  return building;
}

// The plane z = 0 of 4 m by 4 m, seen from above, in cells of 10 cm.
inline PlaneGrid FloorGrid() {
  PlaneGrid grid;
  grid.cell_m = 0.1;
  grid.columns = grid.rows = 40;
  return grid;
}

}  // namespace slcmap::testing
