#include "mapping/building/build_building.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <set>
#include <utility>

#include "data/core/parallel.h"
#include "mapping/building/horizontal_planes.h"
#include "mapping/building/wall_lines.h"
#include "mapping/building/walls.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxPointSigma_m = 0.05;  // points that are less certain are left out
constexpr double kBehind_m = 0.15;         // a ray that ends so far behind a face went through it

constexpr double kUprightSine = 0.3;       // of the normals of upright surfaces
constexpr double kLeastNormal = 0.5;       // shorter: unknown
constexpr double kHitSlack_m = 0.05;       // of points at a face from its plane
constexpr double kSupportSlack_m = 0.025;  // of points on it
constexpr double kMostSlack_m = 0.075;     // of uncertain ones, at it
constexpr double kBesideWall_m = 0.12;     // as far, something is before or behind it
constexpr double kOther_m2 = 0.5;          // of a plane that is no wall but worth telling
constexpr double kBeforeWall_m = 0.1;      // in the room that a wall bounds
constexpr double kHitSigmas = 3;

// Shares of the time, about, up to the end of a stage.
constexpr double kSorted = 0.1, kFaced = 0.4, kCrossed = 0.85;

// What belongs to a storey.
struct LevelData {
  std::vector<FaceSample> samples;
  std::vector<BuiltFace> faces;
  std::vector<FaceGrid> grids;   // by face, until walls are cut at niches
  std::vector<WallFace> unseen;  // backs of walls
};

std::vector<WallFace> MakeWalls(const std::vector<BuiltFace>& faces, double top_m) {
  std::vector<WallFace> walls;
  for (const BuiltFace& built : faces) {
    if (!built.is_wall) continue;
    WallFace wall = built.wall;
    for (const FaceOpening& opening : built.openings) {
      const Interval along{opening.from_m, opening.to_m};
      if (opening.kind == OpeningKind::kDoor) wall.doors.push_back(along);
      if (opening.IsGap(top_m)) wall.gaps.push_back(along);
    }
    walls.push_back(std::move(wall));
  }
  return walls;
}

void AddPointSamples(const BuildingInput& input, const std::vector<Level>& levels,
                     std::vector<LevelData>* data) {
  for (const SurfacePoint& point : input.points) {
    if (point.normal_world.norm() < kLeastNormal ||
        std::abs(point.normal_world.z()) > kUprightSine) {
      continue;
    }
    const int level = LevelAt(levels, point.p_world);
    if (level < 0) continue;
    const Vector2d normal = point.normal_world.head<2>().normalized();
    (*data)[level].samples.push_back(
        {point.p_world, normal, Vector2d::Zero(), std::max(point.sigma_m, 1e-3)});
  }
}

void AddLineSamples(const BuildingInput& input, const std::vector<Level>& levels, double step_m,
                    std::vector<LevelData>* data) {
  constexpr double kLevelSlope = 0.1, kUprightSlope = 0.99;
  for (const MapLine& line : input.lines) {
    const Vector3d way = line.end_world - line.start_world;
    const double length_m = way.norm(), slope = std::abs(way.z()) / std::max(length_m, 1e-9);
    if (length_m < step_m || (slope > kLevelSlope && slope < kUprightSlope)) continue;
    const Vector2d direction =
        slope > kUprightSlope ? Vector2d::Zero() : Vector2d(way.head<2>().normalized());
    const int count = static_cast<int>(length_m / step_m);
    for (int i = 0; i < count; ++i) {
      const Vector3d p = line.start_world + way * ((i + 0.5) / count);
      const int level = LevelAt(levels, p);
      if (level < 0) continue;
      (*data)[level].samples.push_back({p, Vector2d::Zero(), direction, line.sigma_m});
    }
  }
}

// By view, that of its camera; -1: none.
std::vector<int> CollectLevels(const std::vector<ViewRays>& rays,
                               const std::vector<Level>& levels) {
  std::vector<int> level_of;
  for (const ViewRays& view : rays) level_of.push_back(LevelAt(levels, view.p_world_camera));
  return level_of;
}

FreeSpace MakeFreeSpace(const BuildingInput& input, const Level& level,
                        const BuildingOptions& options) {
  constexpr double kMargin_m = 1;
  constexpr double kMaxReach_m = 60;  // of rays from the trajectory; a stray end must not matter
  Eigen::AlignedBox2d places, box;
  for (const Vector3d& place : level.places) places.extend(Vector2d(place.head<2>()));
  box.extend(places);
  for (const SurfacePoint& point : input.points) {
    const Vector2d p = point.p_world.head<2>();
    if (places.squaredExteriorDistance(p) < kMaxReach_m * kMaxReach_m) box.extend(p);
  }
  const Vector2d margin = Vector2d::Constant(kMargin_m);
  return {Eigen::AlignedBox2d(box.min() - margin, box.max() + margin), options.cell_m};
}

// A space of each storey with the free parts of rays between its floor and top, in the plan, up to
// end_of(level, from, to), which is called from several threads.
template <typename EndOf>
std::vector<FreeSpace> FreeSpaces(const BuildingInput& input, const std::vector<Level>& levels,
                                  const BuildingOptions& options, const Progress& progress,
                                  EndOf end_of) {
  std::vector<FreeSpace> spaces;
  for (const Level& level : levels) spaces.push_back(MakeFreeSpace(input, level, options));
  const std::vector<int> level_of = CollectLevels(input.rays, levels);
  const FreeSpaceRays rays(input.rays);
  const auto threads = static_cast<size_t>(std::max(1, cv::getNumThreads()));
  std::vector<std::vector<FreeSpace>> of_threads(threads, spaces);
  const auto add_view = [&](size_t view, std::vector<FreeSpace>* some) {
    const int i = level_of[view];
    if (i < 0) return;
    rays.ForEachIn(view, [&](const Vector3d& camera, const Vector3d& end, double sigma_m) {
      const auto way =
          FindFreeWay(camera, end, sigma_m, levels[i].floor_m, levels[i].top_m, options.cell_m);
      if (way) (*some)[i].AddWay(way->from, end_of(i, way->from, way->to));
    });
  };
  rays.ForSomeViews(progress, [&](size_t begin, size_t end) {
    ForEachWatched(threads, {}, [&](size_t t) {
      for (size_t view = begin + t; view < end; view += threads) add_view(view, &of_threads[t]);
    });
  });
  for (const std::vector<FreeSpace>& some : of_threads) {
    for (size_t i = 0; i < spaces.size(); ++i) spaces[i].AddWaysFrom(some[i]);
  }
  return spaces;
}

void FindLevelFaces(const std::vector<FreeSpace>& spaces, const BuildingOptions& options,
                    std::vector<LevelData>* data) {
  std::vector<Face> all;
  for (size_t i = 0; i < data->size(); ++i) {
    const FreeSpace& free = spaces[i];
    for (Face face : FindFaces((*data)[i].samples,
                               [&](const Vector2d& p) { return free.IsFree(p); }, options)) {
      face.level = static_cast<int>(i);
      all.push_back(face);
    }
  }
  AgreeHeadings(&all);
  for (const Face& face : all)
    (*data)[face.level].faces.push_back({{face, {}, options.cell_m}, {}});
}

void AddHits(const LevelData& data, const Face& face, FaceGrid* grid) {
  for (const FaceSample& sample : data.samples) {
    const Vector2d p = sample.p_world.head<2>();
    const double distance_m = std::abs(face.DistanceTo(p)), along_m = face.MeasureAlong(p);
    if (distance_m > kBesideWall_m) continue;
    // The cheeks of an opening do not close it, nor does what faces the other way.
    if (!sample.normal.isZero() && sample.normal.dot(face.normal) < 0.5) continue;
    const double z_m = sample.p_world.z();
    if (distance_m <= std::clamp(kHitSigmas * sample.sigma_m, kHitSlack_m, kMostSlack_m)) {
      grid->AddHit(along_m, z_m);
    }
    if (distance_m <= std::clamp(2 * sample.sigma_m, kSupportSlack_m, kHitSlack_m)) {
      grid->AddSupport(along_m, z_m);
    } else {
      grid->AddOther(along_m, z_m, face.DistanceTo(p) < 0);
    }
  }
}

void FillGrids(const BuildingInput& input, const std::vector<Level>& levels,
               const BuildingOptions& options, const Progress& progress,
               std::vector<LevelData>* data) {
  for (size_t i = 0; i < data->size(); ++i) {
    LevelData& level = (*data)[i];
    for (const BuiltFace& built : level.faces) {
      level.grids.emplace_back(built.wall.face, levels[i].floor_m, levels[i].top_m, options.cell_m);
      AddHits(level, built.wall.face, &level.grids.back());
    }
  }
  const std::vector<int> level_of = CollectLevels(input.rays, levels);
  const FreeSpaceRays rays(input.rays);
  std::vector<std::pair<size_t, size_t>> faces;  // level, and face of it
  for (size_t i = 0; i < data->size(); ++i) {
    for (size_t k = 0; k < (*data)[i].faces.size(); ++k) faces.emplace_back(i, k);
  }
  rays.ForSomeViews(progress, [&](size_t begin, size_t end) {
    ForEachWatched(faces.size(), {}, [&](size_t f) {
      const auto [i, k] = faces[f];
      const Face& face = (*data)[i].faces[k].wall.face;
      FaceGrid* grid = &(*data)[i].grids[k];
      for (size_t view = begin; view < end; ++view) {
        if (level_of[view] != static_cast<int>(i)) continue;
        rays.ForEachIn(view, [&](const Vector3d& camera, const Vector3d& ray_end, double sigma_m) {
          AddRay(face, camera, ray_end, sigma_m, kBehind_m, grid);
        });
      }
    });
  });
}

void LookAtFaces(const BuildingInput& input, const Level& level, const BuildingOptions& options,
                 LevelData* data) {
  for (size_t k = 0; k < data->faces.size(); ++k) {
    WallCover cover = FindCover(data->grids[k]);
    WallFace& wall = data->faces[k].wall;
    wall.shares = std::move(cover.shares);
    wall.is_solid = std::move(cover.is_solid);
    wall.measured_m = cover.measured_m;
  }
  SelectWalls(level, &data->faces);
  for (size_t k = 0; k < data->faces.size(); ++k) {
    BuiltFace& built = data->faces[k];
    if (!built.is_wall) continue;
    built.openings = FindOpenings(built.wall.face, data->grids[k], level, input);
  }
  CutAtGaps(level, &data->faces);
  data->unseen = UnseenFaces(MakeWalls(data->faces, level.top_m), options);
}

void AddRooms(const BuildingInput& input, const Level& level, int64_t storey,
              const BuildingOptions& options, const LevelData& data, const FreeSpace& inside,
              Building* building) {
  std::vector<WallFace> walls = MakeWalls(data.faces, level.top_m);
  walls.insert(walls.end(), data.unseen.begin(), data.unseen.end());
  for (const FoundRoom& found : FindRooms(walls, inside, options)) {
    Room room;
    room.id = static_cast<int64_t>(building->rooms.size());
    room.storey = storey;
    room.polygon = found.polygon;
    room.area_m2 = Area(found.polygon);
    room.bounded = found.bounded;
    AddFloorAndCeiling(input, level, &room, &building->planes);
    building->rooms.push_back(room);
  }
}

// The largest room has the heights of its storey; what is seen first is noise's nearer side.
void FitHeights(const std::vector<Room>& rooms, Storey* storey, Level* level, LevelData* data) {
  constexpr double kNoise_m = 0.1;  // farther off, a room has heights of its own
  const Room* largest = nullptr;
  for (const Room& room : rooms) {
    if (room.storey != storey->id) continue;
    if (largest == nullptr || room.area_m2 > largest->area_m2) largest = &room;
  }
  if (largest == nullptr || std::abs(largest->floor_m - level->floor_m) > kNoise_m) return;
  const double top_m = level->top_m, ceiling_m = largest->floor_m + largest->height_m.value_or(0);
  if (largest->height_m && level->ceiling_m &&
      std::abs(ceiling_m - *level->ceiling_m) <= kNoise_m) {
    level->ceiling_m = storey->ceiling_m = level->top_m = ceiling_m;
  }
  for (BuiltFace& built : data->faces) {
    for (FaceOpening& opening : built.openings) {
      if (opening.low_m == level->floor_m) opening.low_m = largest->floor_m;
      if (opening.high_m >= std::min(top_m, level->top_m)) opening.high_m = level->top_m;
    }
  }
  level->floor_m = storey->floor_m = largest->floor_m;
}

Vector3d OnPlane(const Face& face, double along_m, double z_m) {
  const Vector2d p = face.PointAt(along_m);
  return {p.x(), p.y(), z_m};
}

std::vector<Vector3d> Rectangle(const Face& face, double from_m, double to_m, double low_m,
                                double high_m) {
  return {OnPlane(face, from_m, low_m), OnPlane(face, to_m, low_m), OnPlane(face, to_m, high_m),
          OnPlane(face, from_m, high_m)};
}

// Of a wall from its storey's floor to its top; of other things as far as they were measured.
BuildingPlane MakePlane(const BuiltFace& built, const Level& level) {
  const Face& face = built.wall.face;
  BuildingPlane plane;
  plane.id = built.plane_id;
  plane.kind = built.is_wall ? PlaneKind::kWall : PlaneKind::kOther;
  plane.storey = face.level;
  plane.normal = {face.normal.x(), face.normal.y(), 0};
  plane.offset_m = face.offset_m;
  plane.sigma_m = face.sigma_m;
  plane.inferred = built.is_inferred;
  plane.outline_world = built.is_wall
                            ? Rectangle(face, face.from_m, face.to_m, level.floor_m, level.top_m)
                            : Rectangle(face, face.from_m, face.to_m, face.low_m, face.high_m);
  for (const FaceOpening& opening : built.openings) {
    plane.openings.push_back(
        {opening.kind, opening.walked, opening.to_m - opening.from_m,
         opening.high_m - opening.low_m,
         Rectangle(face, opening.from_m, opening.to_m, opening.low_m, opening.high_m)});
  }
  return plane;
}

// The parts of a face with a room before them that ends there, but for short ones.
std::vector<Face> PartsAtRooms(const WallFace& wall, const std::vector<Room>& rooms) {
  constexpr double kNear_m = 0.05, kLeast_m = 0.8;
  const Face& face = wall.face;
  const auto is_inside = [&](double along_m, double before_m) {
    const Vector2d p = face.PointAt(along_m) + before_m * face.normal;
    return std::any_of(rooms.begin(), rooms.end(), [&](const Room& room) {
      return room.storey == face.level && Contains(room.polygon, p);
    });
  };
  std::vector<Face> parts;
  bool was_border = false;
  for (double along_m = face.from_m; along_m < face.to_m; along_m += wall.step_m) {
    const bool is_border = is_inside(along_m, kNear_m) && !is_inside(along_m, -kNear_m);
    if (is_border && !was_border) {
      parts.push_back(face);
      parts.back().from_m = along_m;
    }
    if (is_border) parts.back().to_m = std::min(along_m + wall.step_m, face.to_m);
    was_border = is_border;
  }
  std::erase_if(parts, [](const Face& part) { return part.Length() < kLeast_m; });
  return parts;
}

// Openings of the fronts of a wall, as its back has them.
std::vector<FaceOpening> OpeningsBehind(const std::vector<BuiltFace>& faces, const Face& back,
                                        const BuildingOptions& options) {
  std::vector<FaceOpening> openings;
  for (const BuiltFace& front : faces) {
    if (front.is_inferred || !BodyBetween(front.wall.face, back, options)) continue;
    for (FaceOpening opening : front.openings) {
      const double a = back.MeasureAlong(front.wall.face.PointAt(opening.from_m));
      const double b = back.MeasureAlong(front.wall.face.PointAt(opening.to_m));
      opening.from_m = std::max(std::min(a, b), back.from_m);
      opening.to_m = std::min(std::max(a, b), back.to_m);
      if (opening.to_m - opening.from_m >= kBuildingMinOpening_m) openings.push_back(opening);
    }
  }
  return openings;
}

void AddUnseenFaces(const std::vector<Room>& rooms, const BuildingOptions& options,
                    LevelData* data) {
  for (const WallFace& wall : data->unseen) {
    for (const Face& part : PartsAtRooms(wall, rooms)) {
      BuiltFace built;
      built.wall = {part, {}, wall.step_m};
      built.openings = OpeningsBehind(data->faces, part, options);
      built.is_wall = built.is_inferred = true;
      data->faces.push_back(std::move(built));
    }
  }
}

std::vector<int64_t> RoomsBefore(const BuiltFace& built, const std::vector<Room>& rooms) {
  constexpr double kStep_m = 0.2;
  const Face& face = built.wall.face;
  std::set<int64_t> ids;
  for (double along_m = face.from_m + 0.5 * kStep_m; along_m < face.to_m; along_m += kStep_m) {
    const Vector2d p = face.PointAt(along_m) + kBeforeWall_m * face.normal;
    for (const Room& room : rooms) {
      if (room.storey == face.level && Contains(room.polygon, p)) ids.insert(room.id);
    }
  }
  return {ids.begin(), ids.end()};
}

void AddPlanes(const std::vector<Level>& levels, std::vector<LevelData>* data, Building* building) {
  for (size_t i = 0; i < data->size(); ++i) {
    CloseCorners(&(*data)[i].faces);
    for (BuiltFace& built : (*data)[i].faces) {
      if (!built.is_wall && built.wall.face.area_m2 < kOther_m2) continue;
      built.plane_id = static_cast<int64_t>(building->planes.size());
      building->planes.push_back(MakePlane(built, levels[i]));
      if (built.is_wall) building->planes.back().room_ids = RoomsBefore(built, building->rooms);
    }
  }
}

RigidTransform MapFrame(const std::vector<BuiltFace>& faces) {
  std::vector<Face> walls;
  for (const BuiltFace& built : faces) {
    if (built.is_wall) walls.push_back(built.wall.face);
  }
  return {Eigen::Quaterniond(Eigen::AngleAxisd(-MainHeading(walls), Vector3d::UnitZ())),
          Vector3d::Zero()};
}

}  // namespace

Building BuildBuilding(const BuildingInput& all, const BuildingOptions& options,
                       const Progress& progress) {
  options.Check();
  BuildingInput input = all;
  std::erase_if(input.points, [&](const SurfacePoint& point) {
    return !(point.sigma_m <= kMaxPointSigma_m) || !point.p_world.allFinite();
  });
  Building building;
  std::vector<Level> levels = FindLevels(input);
  for (const Level& level : levels) {
    building.storeys.push_back(
        {static_cast<int64_t>(building.storeys.size()), level.floor_m, level.ceiling_m});
  }
  std::vector<LevelData> data(levels.size());
  AddPointSamples(input, levels, &data);
  AddLineSamples(input, levels, kBuildingLineSample_m, &data);
  const std::vector<FreeSpace> free =
      FreeSpaces(input, levels, options, progress.Part(kSorted, 0.5 * (kSorted + kFaced)),
                 [](int, const Vector2d&, const Vector2d& to) { return to; });
  FindLevelFaces(free, options, &data);
  FillGrids(input, levels, options, progress.Part(kFaced, kCrossed), &data);
  std::vector<BuiltFace> faces;
  for (size_t i = 0; i < data.size(); ++i) LookAtFaces(input, levels[i], options, &data[i]);
  // What is before walls, or seen through doors.
  const std::vector<FreeSpace> inside =
      FreeSpaces(input, levels, options, progress.Part(kCrossed, 1),
                 [&](int i, const Vector2d& from, const Vector2d& to) -> Vector2d {
                   return from + ShareBeforeWalls(data[i].faces, from, to) * (to - from);
                 });
  for (size_t i = 0; i < data.size(); ++i) {
    AddRooms(input, levels[i], static_cast<int64_t>(i), options, data[i], inside[i], &building);
    FitHeights(building.rooms, &building.storeys[i], &levels[i], &data[i]);
  }
  for (LevelData& level : data) AddUnseenFaces(building.rooms, options, &level);
  AddPlanes(levels, &data, &building);
  for (const LevelData& level : data) {
    faces.insert(faces.end(), level.faces.begin(), level.faces.end());
  }
  building.walls = PlanWalls(faces, levels, options);
  building.T_map_world = MapFrame(faces);
  return building;
}

}  // namespace slcmap::mapping
