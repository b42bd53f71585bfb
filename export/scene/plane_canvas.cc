#include "export/scene/plane_canvas.h"

#include <Eigen/Geometry>
#include <cmath>

#include "export/scene/meshes.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Polygon OutlineOn(const Canvas& canvas, const BuildingPlane& plane, const Building& building) {
  if (plane.kind != PlaneKind::kFloor && plane.kind != PlaneKind::kCeiling) {
    return {PointsOn(canvas, plane.outline_world), {}};
  }
  Polygon outline = LevelOutline(plane, building);
  const auto move = [&](PlanPoints* points) {
    for (Vector2d& p : *points) p = canvas.Of({p.x(), p.y(), plane.offset_m / plane.normal.z()});
  };
  move(&outline.outline);
  for (PlanPoints& hole : outline.holes) move(&hole);
  return outline;
}

}  // namespace

PlanPoints PointsOn(const Canvas& canvas, const std::vector<Vector3d>& points_world) {
  PlanPoints points;
  for (const Vector3d& p : points_world) points.push_back(canvas.Of(p));
  return points;
}

Canvas MakeFront(const BuildingPlane& plane) {
  const Vector3d& normal = plane.normal;
  const bool is_level = std::abs(normal.z()) > M_SQRT1_2;
  Canvas canvas;
  canvas.x = is_level ? Vector3d(Vector3d::UnitX() - normal.x() * normal).normalized()
                      : Vector3d::UnitZ().cross(normal).normalized();
  canvas.y = normal.cross(canvas.x);
  canvas.origin = plane.offset_m * normal;
  // Where heights are 0, or x and y of the world.
  const Vector3d zero = canvas.At(canvas.Of(Vector3d::Zero()));
  canvas.origin = is_level ? zero : zero - zero.z() / canvas.y.z() * canvas.y;
  return canvas;
}

std::vector<Polygon> AreaOn(const Canvas& canvas, const BuildingPlane& plane,
                            const Building& building) {
  std::vector<PlanPoints> openings;
  for (const PlaneOpening& opening : plane.openings) {
    openings.push_back(PointsOn(canvas, opening.outline_world));
  }
  return Difference(OutlineOn(canvas, plane, building), openings);
}

}  // namespace slcmap::exporting
