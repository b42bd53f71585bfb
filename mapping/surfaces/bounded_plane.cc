#include "mapping/surfaces/bounded_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mapping/dense/dense_map.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRoomReach_m = 4;  // as reach_m, of floors and ceilings of rooms

Vector2d FindCell(const PlaneGrid& grid, const Vector3d& p) {
  return {(grid.u.dot(p) - grid.from_u_m) / grid.cell_m,
          (grid.v.dot(p) - grid.from_v_m) / grid.cell_m};
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Whether p and q lie on different sides of the line through a and b.
bool AreApart(const Vector2d& a, const Vector2d& b, const Vector2d& p, const Vector2d& q) {
  return Cross(b - a, p - a) * Cross(b - a, q - a) < 0;
}

}  // namespace

PlaneBorders::PlaneBorders(const PlaneGrid& grid, const std::vector<MapLine>& lines,
                           double beside_m) {
  for (const MapLine& line : lines) {
    if (line.kind == LineKind::kMark || line.kind == LineKind::kPipe ||
        std::abs(grid.DistanceTo(line.start_world)) > beside_m ||
        std::abs(grid.DistanceTo(line.end_world)) > beside_m) {
      continue;
    }
    borders_.push_back({FindCell(grid, line.start_world), FindCell(grid, line.end_world)});
  }
}

bool PlaneBorders::Part(const Vector2d& a, const Vector2d& b) const {
  return std::any_of(borders_.begin(), borders_.end(), [&](const Border& border) {
    return AreApart(border.start, border.end, a, b) && AreApart(a, b, border.start, border.end);
  });
}

namespace {

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
Polygon MakePolygon(const BuildingPlane& plane, const Building& building, const PlaneGrid& grid) {
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

PlaneGrid MakeGridAxes(const BuildingPlane& plane, double cell_m) {
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

}  // namespace

BoundedPlane BoundPlane(const BuildingPlane& plane, const Building& building,
                        const PlaneOptions& options) {
  const bool is_wall = plane.kind == PlaneKind::kWall;
  BoundedPlane bounded{MakeGridAxes(plane, options.cell_m),      {},      plane.sigma_m,
                       is_wall ? options.reach_m : kRoomReach_m, is_wall, !plane.inferred};
  PlaneGrid& grid = bounded.grid;
  const Polygon polygon = MakePolygon(plane, building, grid);
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

std::vector<BoundedPlane> BoundedPlanes(const Building& building, const PlaneOptions& options) {
  std::vector<BoundedPlane> planes;
  for (const BuildingPlane& plane : building.planes) {
    // Of an inferred wall nothing was seen that could be filled in.
    const bool is_wall = plane.kind == PlaneKind::kWall;
    if (plane.kind == PlaneKind::kOther || (is_wall && plane.inferred)) continue;
    if (plane.outline_world.size() < 3) continue;
    planes.push_back(BoundPlane(plane, building, options));
  }
  return planes;
}

namespace {

constexpr double kFacingCosine = 0.7;  // cosine between normals
constexpr double kMoved_m = 0.02;      // less, and a point is where stereo had it
constexpr double kMerged_m = 0.03;     // of points that are one

// A plane that a point lies on, and how far it is from it.
struct Drawn {
  const BoundedPlane* plane = nullptr;
  double distance_m = 0, surface_sigma_m = 0;
};

Drawn NearestPlane(const std::vector<BoundedPlane>& planes, const DensePoint& point,
                   const PlaneOptions& options) {
  Drawn nearest;
  double least_sigmas = options.draw_sigmas;
  for (const BoundedPlane& plane : planes) {
    const PlaneGrid& grid = plane.grid;
    if (!plane.is_measured || grid.normal.dot(point.normal_world) < kFacingCosine) continue;
    const double distance_m = grid.DistanceTo(point.p_world);
    const double surface_sigma_m = std::hypot(plane.sigma_m, options.surface_sigma_m);
    const double sigmas = std::abs(distance_m) / std::hypot(surface_sigma_m, point.sigma_m);
    if (sigmas > least_sigmas) continue;
    const int column = grid.FindColumn(point.p_world), row = grid.FindRow(point.p_world);
    if (!grid.Contains(column, row) || !plane.inside(row, column)) continue;
    least_sigmas = sigmas;
    nearest = {&plane, distance_m, surface_sigma_m};
  }
  return nearest;
}

// How far it has moved.
double Draw(const Drawn& to, DensePoint* point) {
  const double plane = to.surface_sigma_m * to.surface_sigma_m;
  const double stereo = point->sigma_m * point->sigma_m;
  const double move_m = to.distance_m * stereo / (plane + stereo);
  point->p_world -= move_m * to.plane->grid.normal;
  point->sigma_m = std::sqrt(plane * stereo / (plane + stereo));
  return std::abs(move_m);
}

// Those that have moved, and are where a better known one is now.
std::vector<bool> OnBetterOnes(const std::vector<DensePoint>& dense,
                               const std::vector<double>& moved_m) {
  std::vector<size_t> order(dense.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order,
                           [&](size_t a, size_t b) { return dense[a].sigma_m < dense[b].sigma_m; });
  PointIndex taken(kMerged_m);
  std::vector<bool> gone(dense.size());
  for (const size_t i : order) {
    const Vector3d& p = dense[i].p_world;
    const auto faces_alike = [&](size_t k) {
      return dense[k].normal_world.dot(dense[i].normal_world) > 0;  // else another side of it
    };
    gone[i] = moved_m[i] > kMoved_m && taken.AnyNear(p, kMerged_m, faces_alike);
    if (!gone[i]) taken.Add(p, i);
  }
  return gone;
}

}  // namespace

void SnapToPlanes(const Building& building, const PlaneOptions& options,
                  std::vector<DensePoint>* dense) {
  if (!(options.draw_sigmas > 0)) return;
  const std::vector<BoundedPlane> planes = BoundedPlanes(building, options);
  std::vector<double> moved_m(dense->size());
  for (size_t i = 0; i < dense->size(); ++i) {
    const Drawn to = NearestPlane(planes, (*dense)[i], options);
    if (to.plane) moved_m[i] = Draw(to, &(*dense)[i]);
  }
  const std::vector<bool> gone = OnBetterOnes(*dense, moved_m);
  size_t kept = 0;
  for (size_t i = 0; i < dense->size(); ++i) {
    if (!gone[i]) (*dense)[kept++] = (*dense)[i];
  }
  dense->resize(kept);
}

void AddFilledPoints(std::vector<DensePoint> filled, double spacing_m, MapResult* map) {
  MarkSurfaces(filled, spacing_m, &map->occupancy);
  map->occupancy.Finish();
  map->filled = std::move(filled);
}

}  // namespace slcmap::mapping
