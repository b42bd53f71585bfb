#include "export/surface_mesh.h"

#include <cmath>

#include "data/plane_triangulation.h"
#include "export/colour_scale.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How bright a surface is that looks there.
Colour Lit(const Colour& colour, const Vector3d& normal) {
  const Vector3d light = Vector3d(0.35, 0.55, 0.76);
  return Shade(colour, 0.74 + 0.25 * normal.dot(light));
}

// A plane in space: x and y of a polygon go along two directions, which are square to each other.
struct Canvas {
  Vector3d origin = Vector3d::Zero(), x = Vector3d::UnitX(), y = Vector3d::UnitY();

  Vector3d At(const Vector2d& p) const { return origin + p.x() * x + p.y() * y; }
  Vector2d Of(const Vector3d& p) const { return {(p - origin).dot(x), (p - origin).dot(y)}; }
  Vector3d Normal() const { return x.cross(y); }
};

uint32_t AddVertex(const Vector3d& p, const Colour& colour, MeshLayer* layer) {
  layer->vertices.Add(p, colour);
  return static_cast<uint32_t>(layer->vertices.size() - 1);
}

// The side of the canvas that its normal looks to.
void AddFace(const Polygon& polygon, const Canvas& canvas, const Colour& colour, MeshLayer* layer) {
  for (const PlanTriangle& triangle : Triangulate(polygon)) {
    std::array<uint32_t, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
      corners[i] = AddVertex(canvas.At(triangle[i]), colour, layer);
    layer->triangles.push_back(corners);
  }
}

// Where the back of a wall has the points of its front.
class BackOfFront {
 public:
  BackOfFront(const Canvas& front, const Vector3d& depth, double length_m, const WallBack& back)
      : front_(front), depth_(depth), length_m_(length_m), back_(back) {}

  Vector3d At(const Vector2d& p) const {
    double x = p.x();
    if (x < kLeastSolid_m) x -= back_.before_start_m;
    if (x > length_m_ - kLeastSolid_m) x += back_.beyond_end_m;
    return front_.At({x, p.y()}) + depth_;
  }

 private:
  const Canvas& front_;
  const Vector3d depth_;
  const double length_m_;
  const WallBack back_;
};

// A strip between the edges of an outline, which has its inside on the left, and those behind.
void AddSides(const PlanPoints& outline, const Canvas& canvas, const BackOfFront& back,
              const Colour& colour, MeshLayer* layer) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d& next = outline[(i + 1) % outline.size()];
    const Vector3d a = canvas.At(outline[i]), b = canvas.At(next);
    const Vector3d normal = (b - a).cross(a - back.At(outline[i])).normalized();
    const Colour lit = Lit(colour, normal);
    const uint32_t first = AddVertex(a, lit, layer);
    AddVertex(b, lit, layer);
    AddVertex(back.At(next), lit, layer);
    AddVertex(back.At(outline[i]), lit, layer);
    layer->triangles.push_back({first, first + 2, first + 1});
    layer->triangles.push_back({first, first + 3, first + 2});
  }
}

// The other side of a solid whose front is the polygon.
void AddBack(const Polygon& polygon, const BackOfFront& back, const Colour& colour,
             MeshLayer* layer) {
  for (const PlanTriangle& triangle : Triangulate(polygon)) {
    std::array<uint32_t, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = AddVertex(back.At(triangle[2 - i]), colour, layer);
    }
    layer->triangles.push_back(corners);
  }
}

PlanPoints RectangleOf(const Eigen::AlignedBox2d& box) {
  return {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
}

PlanPoints PointsOn(const Canvas& canvas, const std::vector<Vector3d>& points_world) {
  PlanPoints points;
  for (const Vector3d& p : points_world) points.push_back(canvas.Of(p));
  return points;
}

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

void AddWallMesh(const PlanWall& wall, const WallHeight& height, const Colour& colour,
                 MeshLayer* layer, const WallBack& back) {
  if (!IsSolid(wall, height)) return;
  const double length_m = (wall.end - wall.start).norm();
  const Vector2d along = (wall.end - wall.start) / length_m;
  // The measured face looks to the right of the way from start to end.
  const Canvas front{{wall.start.x(), wall.start.y(), height.floor_m},
                     {along.x(), along.y(), 0},
                     Vector3d::UnitZ()};
  const BackOfFront behind(front, -wall.thickness_m * front.Normal(), length_m, back);
  std::vector<PlanPoints> holes;
  for (const PlanOpening& opening : wall.openings) {
    if (const auto hole = HoleOf(opening, wall, height)) holes.push_back(RectangleOf(*hole));
  }
  const Eigen::AlignedBox2d all(Vector2d(0, 0), Vector2d(length_m, height.height_m));
  for (const Polygon& part : Difference({RectangleOf(all), {}}, holes)) {
    AddFace(part, front, Lit(colour, front.Normal()), layer);
    AddBack(part, behind, Lit(colour, -front.Normal()), layer);
    AddSides(part.outline, front, behind, colour, layer);
    for (const PlanPoints& hole : part.holes) AddSides(hole, front, behind, colour, layer);
  }
}

Polygon LevelOutline(const BuildingPlane& plane, const Building& building) {
  for (const Room& room : building.rooms) {
    if (plane.room_ids.size() == 1 && room.id == plane.room_ids[0]) return room.polygon;
  }
  Polygon polygon;
  for (const Vector3d& p : plane.outline_world) polygon.outline.push_back(p.head<2>());
  return polygon;
}

std::vector<std::vector<Vector3d>> LevelHoles(const BuildingPlane& plane,
                                              const Building& building) {
  std::vector<std::vector<Vector3d>> holes_world;
  if (plane.kind != PlaneKind::kFloor && plane.kind != PlaneKind::kCeiling) return holes_world;
  for (const PlanPoints& hole : LevelOutline(plane, building).holes) {
    std::vector<Vector3d>& hole_world = holes_world.emplace_back();
    for (const Vector2d& p : hole) {
      const double z_m = (plane.offset_m - plane.normal.head<2>().dot(p)) / plane.normal.z();
      hole_world.emplace_back(p.x(), p.y(), z_m);
    }
  }
  return holes_world;
}

void AddPlaneMesh(const BuildingPlane& plane, const Building& building, const Colour& colour,
                  MeshLayer* layer) {
  Canvas canvas;
  canvas.origin = plane.offset_m * plane.normal;
  canvas.x = plane.normal.unitOrthogonal();
  canvas.y = plane.normal.cross(canvas.x);
  std::vector<PlanPoints> openings;
  for (const PlaneOpening& opening : plane.openings) {
    openings.push_back(PointsOn(canvas, opening.outline_world));
  }
  for (const Polygon& part : Difference(OutlineOn(canvas, plane, building), openings)) {
    AddFace(part, canvas, Lit(colour, plane.normal), layer);
  }
}

}  // namespace slcmap
