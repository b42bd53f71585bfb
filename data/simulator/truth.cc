#include "data/simulator/truth.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "data/io/file.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCell_m = 0.4;         // of points on walls
constexpr double kOpeningCell_m = 0.2;  // of points in openings
constexpr double kRange_m = 8;
constexpr double kInterval_s = 0.5;  // between frames that are looked at
constexpr double kGrid_m = 1e-4;     // of the plan
constexpr double kMeets_m = 1e-3;
constexpr double kWallAbove_m = 1.2;  // over a floor: what reaches so high parts rooms
constexpr double kBentPiece_m = 0.5;  // of a room's outline
constexpr double kLeastRoom_m2 = 0.5;

Vector3d Displaced(const Scene& scene, const Vector3d& p_world) {
  return scene.inexact ? scene.inexact->Displaced(p_world) : p_world;
}

// A point of a face by metres along its foot and above it.
Vector3d OnFace(const Scene& scene, const SceneWallFace& face, double along_m, double up_m) {
  const Vector3d along = (face.end_world - face.foot_world).normalized();
  return Displaced(scene, face.foot_world + along_m * along + up_m * Vector3d::UnitZ());
}

double ComputeLength(const SceneWallFace& face) {
  return (face.end_world - face.foot_world).norm();
}

// The middles of cells between two ends, each of about that size.
std::vector<double> Middles(double from, double to, double cell_m) {
  const int count = std::max(1, static_cast<int>(std::lround((to - from) / cell_m)));
  std::vector<double> middles;
  for (int i = 0; i < count; ++i) middles.push_back(from + (i + 0.5) * (to - from) / count);
  return middles;
}

std::vector<Vector3d> Rectangle(const Scene& scene, const SceneWallFace& face, double from,
                                double to, double low, double high) {
  return {OnFace(scene, face, from, low), OnFace(scene, face, to, low),
          OnFace(scene, face, to, high), OnFace(scene, face, from, high)};
}

bool InOpening(const SceneWallFace& face, double along_m, double up_m) {
  return std::any_of(face.openings.begin(), face.openings.end(), [&](const SceneOpening& hole) {
    return along_m > hole.from_m && along_m < hole.to_m && up_m > hole.low_m && up_m < hole.high_m;
  });
}

// The points of a face's grid that no opening cuts out.
std::vector<Vector3d> MakeGrid(const Scene& scene, const SceneWallFace& face) {
  std::vector<Vector3d> points;
  for (const double along : Middles(0, ComputeLength(face), kCell_m)) {
    for (const double up : Middles(0, face.height_m, kCell_m)) {
      if (!InOpening(face, along, up)) points.push_back(OnFace(scene, face, along, up));
    }
  }
  return points;
}

// Of least squares, with its normal towards the front.
void FitPlane(const std::vector<Vector3d>& points, const Vector3d& front, TrueWall* wall) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  wall->normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  // Too few points to tell a plane.
  if (std::abs(wall->normal.dot(front)) < 0.9) wall->normal = front;
  if (wall->normal.dot(front) < 0) wall->normal = -wall->normal;
  wall->offset_m = wall->normal.dot(mean);
}

// A level slab.
struct Level {
  double z_m;
  PlanPoints corners;
  bool faces_down;
};

std::vector<Level> CollectLevels(const Scene& scene) {
  std::vector<Level> levels;
  for (const SceneQuad& quad : scene.quads) {
    if (quad.body < 0 || scene.bodies[quad.body].kind != "slab") continue;
    const Eigen::Vector3f normal = quad.u.cross(quad.v).normalized();
    if (std::abs(normal.z()) < 0.9999f) continue;
    Level level{quad.a.z(), {}, normal.z() < 0};
    for (const Eigen::Vector3f& corner :
         {quad.a, Eigen::Vector3f(quad.a + quad.u), Eigen::Vector3f(quad.a + quad.u + quad.v),
          Eigen::Vector3f(quad.a + quad.v)}) {
      level.corners.push_back(corner.head<2>().cast<double>());
    }
    levels.push_back(level);
  }
  return levels;
}

bool IsAcross(const SceneWallFace& face, double z_m) {
  return face.foot_world.z() < z_m && face.foot_world.z() + face.height_m > z_m;
}

// What a wall takes of the plan.
Polygon MakeFootprint(const SceneWallFace& face) {
  const Vector2d a = face.foot_world.head<2>(), b = face.end_world.head<2>();
  const Vector2d back = -face.thickness_m * face.normal.head<2>();
  return {{a, b, b + back, a + back}, {}};
}

// The cells between the walls that cross a level.
std::vector<Polygon> FreeCells(const Scene& scene, double z_m) {
  std::vector<PlanPoints> chains;
  std::vector<Polygon> solids;
  for (const SceneWallFace& face : scene.wall_faces) {
    if (!IsAcross(face, z_m)) continue;
    // A little longer: scenes tell where walls meet to a tenth of a millimetre.
    const Vector2d beyond = kMeets_m * (face.end_world - face.foot_world).head<2>().normalized();
    chains.push_back({face.foot_world.head<2>() - beyond, face.end_world.head<2>() + beyond});
    if (!face.is_solid) continue;  // of a wall with one face, nobody knows what is behind it
    solids.push_back(MakeFootprint(face));
    PlanPoints around = solids.back().outline;
    around.push_back(around.front());
    chains.push_back(around);
  }
  if (chains.empty()) return {};
  std::vector<Polygon> cells;
  for (const Polygon& cell : ArrangementCells(chains, kGrid_m)) {
    if (Area(cell) < kLeastRoom_m2) continue;  // most of a plan's thousands of cells
    double solid_m2 = 0;
    for (const Polygon& solid : solids) solid_m2 += IntersectionArea(cell, solid);
    if (solid_m2 < 0.5 * Area(cell)) cells.push_back(cell);
  }
  return cells;
}

Vector2d PointIn(const Polygon& polygon) {
  // Beside the middle of its longest side.
  Vector2d best = polygon.outline.front();
  double longest = 0;
  for (size_t i = 0; i < polygon.outline.size(); ++i) {
    const Vector2d& a = polygon.outline[i];
    const Vector2d along = polygon.outline[(i + 1) % polygon.outline.size()] - a;
    if (along.norm() <= longest) continue;
    longest = along.norm();
    best = a + 0.5 * along + 0.05 * Vector2d(-along.y(), along.x()).normalized();
  }
  return best;
}

PlanPoints DisplacedOutline(const Scene& scene, const PlanPoints& outline, double z_m) {
  PlanPoints displaced;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const int pieces =
        scene.inexact ? std::max(1, static_cast<int>((b - a).norm() / kBentPiece_m)) : 1;
    for (int k = 0; k < pieces; ++k) {
      const Vector2d p = a + k * (b - a) / pieces;
      displaced.emplace_back(Displaced(scene, {p.x(), p.y(), z_m}).head<2>());
    }
  }
  return displaced;
}

// From the floor under a point to the lowest ceiling above it; 0: there is none.
double HeightAbove(const Scene& scene, const std::vector<Level>& levels, const Vector2d& point,
                   double floor_m) {
  double ceiling_m = 0;
  for (const Level& level : levels) {
    if (!level.faces_down || level.z_m <= floor_m || !Contains({level.corners, {}}, point))
      continue;
    if (ceiling_m == 0 || level.z_m < ceiling_m) ceiling_m = level.z_m;
  }
  if (ceiling_m == 0) return 0;
  return Displaced(scene, {point.x(), point.y(), ceiling_m}).z() -
         Displaced(scene, {point.x(), point.y(), floor_m}).z();
}

TrueRoom MakeRoom(const Scene& scene, const std::vector<Level>& levels, const Polygon& cell,
                  double floor_m) {
  TrueRoom room;
  const double middle_m = floor_m + kWallAbove_m;
  room.polygon.outline = DisplacedOutline(scene, cell.outline, middle_m);
  for (const PlanPoints& hole : cell.holes) {
    room.polygon.holes.push_back(DisplacedOutline(scene, hole, middle_m));
  }
  const Vector2d inside = PointIn(cell);
  room.area_m2 = Area(room.polygon);
  room.floor_m = Displaced(scene, {inside.x(), inside.y(), floor_m}).z();
  room.height_m = HeightAbove(scene, levels, inside, floor_m);
  return room;
}

// Marks what cameras see.
class BuildingWatch {
 public:
  BuildingWatch(const RayScene& rays, const RenderTask& task) : rays_(rays), task_(task) {}

  // Whether any of the poses sees the point.
  bool IsSeen(const Vector3d& p_world) const {
    return std::any_of(poses_.begin(), poses_.end(),
                       [&](const CameraPose& pose) { return Sees(pose, p_world); });
  }

  void AddPoses(int frames) {
    double next_s = 0;
    for (int frame = 0; frame < frames; ++frame) {
      const double t_s = task_.times_s[frame];
      if (t_s < next_s) continue;
      next_s = t_s + kInterval_s;
      for (int c = 0; c < CameraCount(task_.rig); ++c) {
        const RigidTransform T_world_camera = task_.motion.PoseAt(t_s) * task_.rig.T_imu_camera[c];
        poses_.push_back({c, T_world_camera, T_world_camera.Inverse()});
      }
    }
  }

  std::vector<Vector3d> Places() const {
    std::vector<Vector3d> places;
    for (const CameraPose& pose : poses_) places.push_back(pose.T_world_camera.translation);
    return places;
  }

 private:
  struct CameraPose {
    int camera;
    RigidTransform T_world_camera, T_camera_world;
  };

  bool Sees(const CameraPose& pose, const Vector3d& p_world) const {
    return !task_.stop.stop_requested() &&
           IsInSight(rays_, task_.rig.cameras[pose.camera], pose.T_world_camera,
                     pose.T_camera_world * p_world, kRange_m, kSightMargin_m);
  }

  const RayScene& rays_;
  const RenderTask& task_;
  std::vector<CameraPose> poses_;
};

using IsSeen = std::function<bool(const Vector3d&)>;

bool IsIn(const TrueRoom& room, const Vector3d& place) {
  const double up_m = place.z() - room.floor_m;
  return up_m > 0 && (room.height_m == 0 || up_m < room.height_m) &&
         Contains(room.polygon, place.head<2>());
}

void ObserveOpenings(const Scene& scene, const SceneWallFace& face, const IsSeen& is_seen,
                     TrueWall* wall) {
  for (size_t i = 0; i < face.openings.size(); ++i) {
    const SceneOpening& hole = face.openings[i];
    int seen = 0, all = 0;
    for (const double along : Middles(hole.from_m, hole.to_m, kOpeningCell_m)) {
      for (const double up : Middles(hole.low_m, hole.high_m, kOpeningCell_m)) {
        ++all;
        seen += is_seen(OnFace(scene, face, along, up)) ? 1 : 0;
      }
    }
    wall->openings[i].looked_through = static_cast<double>(seen) / all;
  }
}

void ObserveWall(const Scene& scene, const SceneWallFace& face, const IsSeen& is_seen,
                 TrueWall* wall) {
  const double columns = static_cast<double>(Middles(0, ComputeLength(face), kCell_m).size());
  const double rows = static_cast<double>(Middles(0, face.height_m, kCell_m).size());
  const double cell_m2 = ComputeLength(face) * face.height_m / (columns * rows);
  for (const Vector3d& p : MakeGrid(scene, face)) {
    // Before the face, so that its bending between the points of a patch does not hide it.
    if (is_seen(p + 0.5 * kSightMargin_m * wall->normal)) wall->seen_world.push_back(p);
  }
  wall->seen_m2 = cell_m2 * static_cast<double>(wall->seen_world.size());
  ObserveOpenings(scene, face, is_seen, wall);
}

}  // namespace

bool IsInSight(const RayScene& rays, const Camera& camera, const RigidTransform& T_world_camera,
               const Vector3d& p_camera, double range_m, double margin_m) {
  const double distance_m = p_camera.norm();
  if (distance_m > range_m || distance_m <= margin_m) return false;
  const auto pixel = camera.Project(p_camera);
  if (!pixel || !camera.Contains(*pixel)) return false;
  const Vector3d ray = T_world_camera.rotation * (p_camera / distance_m);
  return !rays.Blocked(T_world_camera.translation.cast<float>(), ray.cast<float>(),
                       static_cast<float>(distance_m - margin_m));
}

std::vector<Interval> SeenStretches(const std::vector<uint8_t>& seen, double length_m) {
  const double step_m = length_m / static_cast<double>(seen.size());
  std::vector<Interval> stretches;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const size_t first = i;
    while (i < seen.size() && seen[i]) ++i;
    stretches.push_back({step_m * static_cast<double>(first), step_m * static_cast<double>(i)});
  }
  return stretches;
}

std::vector<TrueWall> TrueWalls(const Scene& scene) {
  std::vector<TrueWall> walls;
  for (const SceneWallFace& face : scene.wall_faces) {
    TrueWall wall;
    wall.id = static_cast<int64_t>(walls.size());
    wall.outline_world = Rectangle(scene, face, 0, ComputeLength(face), 0, face.height_m);
    FitPlane(MakeGrid(scene, face), face.normal, &wall);
    for (const SceneOpening& hole : face.openings) {
      wall.openings.push_back(
          {hole.id, hole.is_door, hole.is_open, hole.is_clear, 0, hole.to_m - hole.from_m,
           Rectangle(scene, face, hole.from_m, hole.to_m, hole.low_m, hole.high_m)});
    }
    walls.push_back(wall);
  }
  return walls;
}

std::vector<TrueRoom> TrueRooms(const Scene& scene) {
  const std::vector<Level> levels = CollectLevels(scene);
  constexpr double kSameLevel_m = 0.05;
  std::vector<TrueRoom> rooms;
  std::vector<double> done_m;
  for (const Level& floor : levels) {
    const auto is_same = [&](double z_m) { return std::abs(z_m - floor.z_m) < kSameLevel_m; };
    if (floor.faces_down || std::any_of(done_m.begin(), done_m.end(), is_same)) continue;
    done_m.push_back(floor.z_m);
    for (const Polygon& cell : FreeCells(scene, floor.z_m + kWallAbove_m)) {
      const bool is_over_slab = std::any_of(levels.begin(), levels.end(), [&](const Level& level) {
        return !level.faces_down && is_same(level.z_m) &&
               Contains({level.corners, {}}, PointIn(cell));
      });
      if (!is_over_slab) continue;
      rooms.push_back(MakeRoom(scene, levels, cell, floor.z_m));
      rooms.back().id = static_cast<int64_t>(rooms.size()) - 1;
    }
  }
  return rooms;
}

TrueBuilding ObserveBuilding(const Scene& scene,
                             const std::function<bool(const Vector3d&)>& is_seen,
                             const std::vector<Vector3d>& places) {
  TrueBuilding building{kCell_m, TrueWalls(scene), TrueRooms(scene)};
  for (size_t i = 0; i < building.walls.size(); ++i) {
    ObserveWall(scene, scene.wall_faces[i], is_seen, &building.walls[i]);
  }
  for (TrueRoom& room : building.rooms) {
    room.is_entered = std::any_of(places.begin(), places.end(),
                                  [&](const Vector3d& place) { return IsIn(room, place); });
  }
  return building;
}

TrueBuilding ObserveBuilding(const Scene& scene, const RayScene& rays, const RenderTask& task,
                             int frames) {
  BuildingWatch watch(rays, task);
  watch.AddPoses(frames);
  return ObserveBuilding(
      scene, [&](const Vector3d& p) { return watch.IsSeen(p); }, watch.Places());
}

namespace {

constexpr double kPipeMargin_m = 0.01;  // a surface this near in front of a point does not hide it
constexpr double kSample_m = 0.05;      // along an axis

// The places along the axis of a pipe that cameras see.
class PipeWatch {
 public:
  PipeWatch(const ScenePipe& pipe, const RayScene& rays) : pipe_(pipe), rays_(rays) {
    const double length_m = (pipe.b - pipe.a).norm();
    seen_.assign(static_cast<size_t>(std::ceil(length_m / kSample_m)), 0);
  }

  void Look(const Camera& camera, const RigidTransform& T_world_camera) {
    const RigidTransform T_camera_world = T_world_camera.Inverse();
    for (size_t i = 0; i < seen_.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(seen_.size());
      if (seen_[i]) continue;
      const Vector3d p = Facing(pipe_.a + share * (pipe_.b - pipe_.a), T_world_camera.translation);
      seen_[i] =
          IsInSight(rays_, camera, T_world_camera, T_camera_world * p, kRange_m, kPipeMargin_m);
    }
  }

  std::vector<Interval> Intervals() const {
    return SeenStretches(seen_, (pipe_.b - pipe_.a).norm());
  }

 private:
  // The point of the surface before a point of the axis.
  Vector3d Facing(const Vector3d& on_axis, const Vector3d& centre) const {
    const Vector3d along = (pipe_.b - pipe_.a).normalized();
    const Vector3d way = centre - on_axis;
    return on_axis + (pipe_.radius_m + kPipeMargin_m) * (way - along.dot(way) * along).normalized();
  }

  const ScenePipe& pipe_;
  const RayScene& rays_;
  std::vector<uint8_t> seen_;
};

void Look(const RenderTask& task, double t_s, std::vector<PipeWatch>* watches) {
  for (int c = 0; c < CameraCount(task.rig); ++c) {
    const RigidTransform T_world_camera = task.motion.PoseAt(t_s) * task.rig.T_imu_camera[c];
    for (PipeWatch& watch : *watches) watch.Look(task.rig.cameras[c], T_world_camera);
  }
}

}  // namespace

std::vector<TruePipe> ObservePipes(const Scene& scene, const RayScene& rays, const RenderTask& task,
                                   int frames) {
  std::vector<PipeWatch> watches;
  for (const ScenePipe& pipe : scene.pipes) watches.emplace_back(pipe, rays);
  double next_s = 0;
  for (int frame = 0; frame < frames && !task.stop.stop_requested(); ++frame) {
    if (task.times_s[frame] < next_s) continue;
    next_s = task.times_s[frame] + kInterval_s;
    Look(task, task.times_s[frame], &watches);
  }
  std::vector<TruePipe> pipes;
  for (size_t i = 0; i < watches.size(); ++i) {
    const ScenePipe& pipe = scene.pipes[i];
    pipes.push_back(
        {static_cast<int64_t>(i), pipe.a, pipe.b, pipe.radius_m, watches[i].Intervals()});
  }
  return pipes;
}

namespace {

// Where the middle of a quad is seen.
Vector3d FindTagMiddle(const std::vector<ScenePatch>& patches, uint32_t quad) {
  for (const ScenePatch& patch : patches) {
    if (patch.quad != quad) continue;
    const Eigen::Array2f at =
        (Eigen::Array2f(0.5f, 0.5f) - patch.from.array()) / patch.size.array();
    if ((at < 0).any() || (at > 1).any()) continue;
    const auto& c = patch.corners;
    const Eigen::Vector3f low = c[0] + at[0] * (c[1] - c[0]), high = c[3] + at[0] * (c[2] - c[3]);
    return (low + at[1] * (high - low)).cast<double>();
  }
  return Vector3d::Constant(NAN);
}

}  // namespace

void WriteTrueControl(const std::string& path, const Scene& scene) {
  std::string text = "name,easting_m,northing_m,height_m,sigma_m\n";
  const std::vector<ScenePatch> patches = SeenPatches(scene);
  for (const SceneTag& tag : scene.tags) {
    Vector3d p = FindTagMiddle(patches, tag.quad);
    if (scene.georeference) p = *scene.georeference * p;
    text += fmt::format("{},{:.5f},{:.5f},{:.5f},0.001\n", tag.name, p.x(), p.y(), p.z());
  }
  WriteFile(path, text);
}

}  // namespace slcmap::data
