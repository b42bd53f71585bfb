#include "mapping/planes/bounded_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Of an outline, in the axes of the plane.
PlanPoints OnPlane(const PlaneGrid& grid, const std::vector<Vector3d>& outline_world) {
  PlanPoints points;
  for (const Vector3d& p : outline_world) points.emplace_back(grid.u.dot(p), grid.v.dot(p));
  return points;
}

PlanPoints OnPlane(const PlaneGrid& grid, const PlanPoints& plan) {
  std::vector<Vector3d> world;
  for (const Vector2d& p : plan) world.emplace_back(p.x(), p.y(), 0);
  return OnPlane(grid, world);
}

// The outline, with openings or the holes of the room as holes.
Polygon PolygonOf(const BuildingPlane& plane, const Building& building, const PlaneGrid& grid) {
  Polygon polygon{OnPlane(grid, plane.outline_world), {}};
  for (const PlaneOpening& opening : plane.openings) {
    polygon.holes.push_back(OnPlane(grid, opening.outline_world));
  }
  if (plane.kind == PlaneKind::kWall) return polygon;
  for (const Room& room : building.rooms) {
    if (std::find(plane.room_ids.begin(), plane.room_ids.end(), room.id) == plane.room_ids.end()) {
      continue;
    }
    for (const PlanPoints& hole : room.polygon.holes) polygon.holes.push_back(OnPlane(grid, hole));
  }
  return polygon;
}

// Rooms are mostly rectangles: along its longest side, the grid's border is that of the room.
Vector3d LongestSide(const std::vector<Vector3d>& outline) {
  Vector3d longest = Vector3d::Zero();
  for (size_t i = 0; i < outline.size(); ++i) {
    const Vector3d side = outline[(i + 1) % outline.size()] - outline[i];
    if (side.norm() > longest.norm()) longest = side;
  }
  return longest.isZero() ? Vector3d::UnitX() : Vector3d(longest.normalized());
}

PlaneGrid AxesOf(const BuildingPlane& plane, double cell_m) {
  PlaneGrid grid;
  grid.normal = plane.normal.normalized();
  const bool is_level = std::abs(grid.normal.z()) > 0.9;
  const Vector3d across =
      is_level ? LongestSide(plane.outline_world) : Vector3d::UnitZ().cross(grid.normal);
  grid.u = (across - across.dot(grid.normal) * grid.normal).normalized();
  grid.v = grid.normal.cross(grid.u);
  grid.offset_m = plane.offset_m;
  grid.cell_m = cell_m;
  return grid;
}

// A floor or ceiling may be filled far where walls say how far it goes.
double ReachOf_m(const BuildingPlane& plane, const Building& building,
                 const PlaneOptions& options) {
  if (plane.kind == PlaneKind::kWall) return options.reach_m;
  const bool is_bounded = std::ranges::all_of(building.rooms, [&](const Room& room) {
    return room.bounded >= options.min_bounded ||
           std::ranges::find(plane.room_ids, room.id) == plane.room_ids.end();
  });
  return is_bounded ? options.room_reach_m : options.reach_m;
}

BoundedPlane Bounded(const BuildingPlane& plane, const Building& building,
                     const PlaneOptions& options) {
  const bool is_wall = plane.kind == PlaneKind::kWall;
  BoundedPlane bounded{AxesOf(plane, options.cell_m),       {},      plane.sigma_m,
                       ReachOf_m(plane, building, options), is_wall, !plane.inferred};
  PlaneGrid& grid = bounded.grid;
  const Polygon polygon = PolygonOf(plane, building, grid);
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : polygon.outline) box.extend(p);
  grid.Cover(box);
  bounded.inside = cv::Mat1b::zeros(grid.rows, grid.columns);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector2d middle(grid.from_u_m + (column + 0.5) * grid.cell_m,
                            grid.from_v_m + (row + 0.5) * grid.cell_m);
      if (Contains(polygon, middle)) bounded.inside(row, column) = 1;
    }
  }
  return bounded;
}

}  // namespace

std::vector<BoundedPlane> BoundedPlanes(const Building& building, const PlaneOptions& options) {
  std::vector<BoundedPlane> planes;
  for (const BuildingPlane& plane : building.planes) {
    // Of an inferred wall nothing was seen that could be filled in.
    const bool is_wall = plane.kind == PlaneKind::kWall;
    if (plane.kind == PlaneKind::kOther || (is_wall && plane.inferred)) continue;
    if (plane.outline_world.size() < 3) continue;
    planes.push_back(Bounded(plane, building, options));
  }
  return planes;
}

}  // namespace slcmap
