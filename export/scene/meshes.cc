#include "export/scene/meshes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "data/core/polygon.h"
#include "export/scene/plane_canvas.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {
namespace {

constexpr int64_t kFaceVertices = 4;

// A face of a cube of edge 2 about the origin.
struct CubeFace {
  std::array<int64_t, 3> normal;
  std::array<Eigen::Vector3d, 4> corners;  // counter-clockwise seen from outside
  double shade;
};

std::vector<CubeFace> CubeFaces() {
  constexpr double kTopShade = 1, kBottomShade = 0.6, kXShade = 0.88, kYShade = 0.76;
  return {{{0, 0, 1}, {{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}}, kTopShade},
          {{0, 0, -1}, {{{-1, 1, -1}, {1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}}, kBottomShade},
          {{1, 0, 0}, {{{1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}}}, kXShade},
          {{-1, 0, 0}, {{{-1, 1, -1}, {-1, -1, -1}, {-1, -1, 1}, {-1, 1, 1}}}, kXShade},
          {{0, 1, 0}, {{{1, 1, -1}, {-1, 1, -1}, {-1, 1, 1}, {1, 1, 1}}}, kYShade},
          {{0, -1, 0}, {{{-1, -1, -1}, {1, -1, -1}, {1, -1, 1}, {-1, -1, 1}}}, kYShade}};
}

// Where voxels are, each in the grid of its own size.
class VoxelGrid {
 public:
  explicit VoxelGrid(const std::vector<Voxel>& voxels) {
    for (const Voxel& voxel : voxels) cells_.push_back(GetCell(voxel, {0, 0, 0}));
    std::sort(cells_.begin(), cells_.end());
  }

  bool HasNeighbour(const Voxel& voxel, const std::array<int64_t, 3>& direction) const {
    return std::binary_search(cells_.begin(), cells_.end(), GetCell(voxel, direction));
  }

 private:
  using Cell = std::array<int64_t, 4>;  // x, y, z, size in micrometres

  static Cell GetCell(const Voxel& voxel, const std::array<int64_t, 3>& offset) {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] =
          static_cast<int64_t>(std::floor(voxel.centre_world[axis] / voxel.size_m)) + offset[axis];
    }
    cell[3] = std::llround(voxel.size_m * 1e6);
    return cell;
  }

  std::vector<Cell> cells_;  // sorted
};

// Every face has its own four vertices, as shades differ.
void AddFace(const Voxel& voxel, const CubeFace& face, const Colour& colour, MeshLayer* layer) {
  const auto first = static_cast<uint32_t>(layer->vertices.size());
  for (const Eigen::Vector3d& corner : face.corners) {
    layer->vertices.Add(voxel.centre_world + 0.5 * voxel.size_m * corner,
                        Shade(colour, face.shade));
  }
  layer->triangles.push_back({first, first + 1, first + 2});
  layer->triangles.push_back({first, first + 2, first + 3});
}

// Calls visit(voxel, face) for each face that is not between two voxels.
template <typename Visitor>
void ForEachFace(const std::vector<Voxel>& voxels, const Progress& progress, Visitor visit) {
  constexpr std::size_t kReportEvery = 1024;
  const VoxelGrid grid(voxels);
  const std::vector<CubeFace> faces = CubeFaces();
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (i % kReportEvery == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(voxels.size()));
    }
    for (const CubeFace& face : faces) {
      if (!grid.HasNeighbour(voxels[i], face.normal)) visit(voxels[i], face);
    }
  }
}

}  // namespace

void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer,
               const Progress& progress) {
  ForEachFace(voxels, progress, [&](const Voxel& voxel, const CubeFace& face) {
    AddFace(voxel, face, colour_of(voxel), layer);
  });
}

int64_t CountVoxelVertices(const std::vector<Voxel>& voxels) {
  int64_t faces = 0;
  ForEachFace(voxels, {}, [&](const Voxel&, const CubeFace&) { ++faces; });
  return kFaceVertices * faces;
}

namespace {

// The corners of a square about the origin, at right angles to a direction: counter-clockwise for
// who looks against it.
std::array<Eigen::Vector3d, 4> Section(const Eigen::Vector3d& direction, double width_m) {
  constexpr double kUpright = 0.99;
  const bool upright = std::abs(direction.z()) > kUpright;
  const Eigen::Vector3d reference = upright ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d side = reference.cross(direction).normalized() * (0.5 * width_m);
  const Eigen::Vector3d up = direction.cross(side);
  return {side - up, side + up, -side + up, -side - up};
}

void AddBar(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const Colour& start_colour,
            const Colour& end_colour, double width_m, MeshLayer* layer) {
  const auto s = static_cast<uint32_t>(layer->vertices.size());
  const uint32_t e = s + 4;  // the end's corners follow those of the start
  const std::array<Eigen::Vector3d, 4> section = Section((end - start).normalized(), width_m);
  for (const Eigen::Vector3d& corner : section) layer->vertices.Add(start + corner, start_colour);
  for (const Eigen::Vector3d& corner : section) layer->vertices.Add(end + corner, end_colour);
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t next = (i + 1) % 4;
    layer->triangles.push_back({s + i, s + next, e + next});
    layer->triangles.push_back({s + i, e + next, e + i});
  }
  layer->triangles.push_back({s + 3, s + 2, s + 1});
  layer->triangles.push_back({s + 3, s + 1, s});
  layer->triangles.push_back({e, e + 1, e + 2});
  layer->triangles.push_back({e, e + 2, e + 3});
}

}  // namespace

void AddBars(const LineLayer& lines, double width_m, MeshLayer* layer) {
  const auto& [positions, colours] = lines.vertices;
  for (const auto& [start, end] : lines.edges) {
    if (positions[start] == positions[end]) continue;
    AddBar(positions[start], positions[end], colours[start], colours[end], width_m, layer);
  }
}

namespace {

constexpr uint32_t kSides = 24;

// Counter-clockwise for who looks against the direction.
std::vector<Eigen::Vector3d> Rim(const Eigen::Vector3d& direction, double radius_m) {
  const Eigen::Vector3d first = direction.unitOrthogonal(), second = direction.cross(first);
  std::vector<Eigen::Vector3d> rim;
  for (uint32_t i = 0; i < kSides; ++i) {
    const double angle_rad = 2 * M_PI * i / kSides;
    rim.emplace_back(radius_m * (std::cos(angle_rad) * first + std::sin(angle_rad) * second));
  }
  return rim;
}

}  // namespace

MapLine MakeAxisLine(const MapPipe& pipe) {
  MapLine line;
  line.id = pipe.id;
  line.segment = pipe.segment;
  line.axis = pipe.axis;
  line.world = pipe.world;
  line.sigma_m = pipe.sigma_m;
  line.start_world = pipe.start_world;
  line.end_world = pipe.end_world;
  line.observations = pipe.images;
  line.kind = LineKind::kPipe;
  return line;
}

void AddTube(const MapPipe& pipe, const Colour& colour, MeshLayer* layer) {
  const Eigen::Vector3d way = pipe.end_world - pipe.start_world;
  if (!(way.norm() > 0)) return;
  const auto s = static_cast<uint32_t>(layer->vertices.size());
  const uint32_t e = s + kSides, start = e + kSides, end = start + 1;
  const std::vector<Eigen::Vector3d> rim = Rim(way.normalized(), pipe.radius_m);
  for (const Eigen::Vector3d& p : rim) layer->vertices.Add(pipe.start_world + p, colour);
  for (const Eigen::Vector3d& p : rim) layer->vertices.Add(pipe.end_world + p, colour);
  layer->vertices.Add(pipe.start_world, colour);
  layer->vertices.Add(pipe.end_world, colour);
  for (uint32_t i = 0; i < kSides; ++i) {
    const uint32_t next = (i + 1) % kSides;
    layer->triangles.push_back({s + i, s + next, e + next});
    layer->triangles.push_back({s + i, e + next, e + i});
    layer->triangles.push_back({start, s + next, s + i});
    layer->triangles.push_back({end, e + i, e + next});
  }
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How bright a surface is that looks there.
Colour Lit(const Colour& colour, const Vector3d& normal) {
  const Vector3d light = Vector3d(0.35, 0.55, 0.76);
  return Shade(colour, 0.74 + 0.25 * normal.dot(light));
}

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

PlanPoints MakeRectangle(const Eigen::AlignedBox2d& box) {
  return {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
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
    if (const auto hole = ComputeHole(opening, wall, height)) holes.push_back(MakeRectangle(*hole));
  }
  const Eigen::AlignedBox2d all(Vector2d(0, 0), Vector2d(length_m, height.height_m));
  for (const Polygon& part : Difference({MakeRectangle(all), {}}, holes)) {
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
  for (const Polygon& part : AreaOn(canvas, plane, building)) {
    AddFace(part, canvas, Lit(colour, plane.normal), layer);
  }
}

}  // namespace slcmap::exporting
