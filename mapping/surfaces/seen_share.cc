#include "mapping/surfaces/seen_share.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>
#include <utility>

#include "data/core/parallel.h"
#include "mapping/map/point_index.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/plane_views.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr double kNowhere_m = std::numeric_limits<double>::infinity();

constexpr int kCell_px = 16;    // of an image, that one ray stands for
constexpr double kRange_m = 8;  // as evaluate measures completeness against true surfaces
constexpr double kVoxel_m = 0.1;
constexpr double kHeld_m = 0.06;     // from a point, a surface is held
constexpr double kBack_m = 0.025;    // half of what a point seen from its back covers,
constexpr double kThin_m = 0.1;      // and how far before it the surface is that was seen
constexpr double kBefore_m = 0.3;    // of a point, by which a plane bars the way to it
constexpr int kPassed = 2;           // rays through a cell of a plane that is there nevertheless
constexpr double kOnWall_m = 0.1;    // from a plane, what belongs to it
constexpr int kAroundNeeded = 3;     // of four directions in the image, that meet something
constexpr double kLeastSeen_m2 = 1;  // of a room or wall, whose share is told

// Views that are looked from: so far from the one before or turned as much, and so many.
constexpr double kApart_m = 0.25, kTurnedApart_rad = 0.2;
constexpr size_t kMostViews = 600;

constexpr double kLeastShare = 0.75;  // of a map that is good
constexpr size_t kNamedRooms = 3;

// A plane of the building as rays meet it.
struct Screen {
  BoundedPlane plane;
  cv::Mat1b windows;    // by cell
  int wall = -1;        // in the building's walls
  bool is_sure = true;  // that it is there, whatever the cloud has behind it
};

// The cells of a plane that are within one of its windows.
cv::Mat1b WindowCells(const BuildingPlane& plane, const PlaneGrid& grid) {
  cv::Mat1b cells(grid.rows, grid.columns, uchar{0});
  for (const PlaneOpening& opening : plane.openings) {
    if (opening.kind != OpeningKind::kWindow) continue;
    Polygon outline;
    for (const Vector3d& p : opening.outline_world) {
      outline.outline.emplace_back(grid.u.dot(p), grid.v.dot(p));
    }
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3d p = grid.At(column + 0.5, row + 0.5);
        if (Contains(outline, {grid.u.dot(p), grid.v.dot(p)})) cells(row, column) = 1;
      }
    }
  }
  return cells;
}

std::vector<Screen> MakeScreens(const Building& building, const std::vector<ViewRays>& rays,
                                const PlaneOptions& options, const Progress& progress) {
  std::map<int64_t, int> wall_of_plane;
  for (size_t i = 0; i < building.walls.size(); ++i) {
    for (const int64_t id : building.walls[i].plane_ids) {
      wall_of_plane.emplace(id, static_cast<int>(i));
    }
  }
  std::vector<const BuildingPlane*> planes;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.outline_world.size() >= 3) planes.push_back(&plane);
  }
  std::vector<Screen> screens(planes.size());
  const auto make = [&](size_t i) {
    const BuildingPlane& plane = *planes[i];
    Screen& screen = screens[i];
    screen.plane = BoundPlane(plane, building, options);
    screen.windows = WindowCells(plane, screen.plane.grid);
    screen.plane.inside.setTo(0, CountPasses(screen.plane.grid, rays) > kPassed);
    const auto wall = wall_of_plane.find(plane.id);
    if (wall != wall_of_plane.end()) screen.wall = wall->second;
    screen.is_sure = !plane.inferred;
  };
  ForEachWatched(planes.size(), progress, make, 8);
  return screens;
}

// What of the building a ray meets first, along it.
struct Meeting {
  double sure_m = kNowhere_m, likely_m = kNowhere_m, window_m = kNowhere_m;
  int sure = -1, likely = -1;  // screens; -1: none, or the height of a storey
};

void MeetScreen(const Screen& screen, int index, const Vector3d& from, const Vector3d& way,
                Meeting* meeting) {
  const PlaneGrid& grid = screen.plane.grid;
  const double towards = grid.normal.dot(way);
  if (towards > -1e-3) return;  // from behind, or along it
  const double at_m = -grid.DistanceTo(from) / towards;
  double& nearest_m = screen.is_sure ? meeting->sure_m : meeting->likely_m;
  if (at_m <= 0 || at_m >= std::max(nearest_m, meeting->window_m)) return;
  const Vector3d p = from + at_m * way;
  const int column = grid.FindColumn(p), row = grid.FindRow(p);
  if (!grid.Contains(column, row)) return;
  if (screen.windows(row, column)) meeting->window_m = std::min(meeting->window_m, at_m);
  if (!screen.plane.inside(row, column) || at_m >= nearest_m) return;
  nearest_m = at_m;
  (screen.is_sure ? meeting->sure : meeting->likely) = index;
}

// Beyond rooms, floors and ceilings are about at the heights of their storey.
void MeetStorey(const Storey& storey, const Vector3d& from, const Vector3d& way, Meeting* meeting) {
  if (from.z() < storey.floor_m || from.z() > storey.ceiling_m.value_or(kNowhere_m)) return;
  double at_m = kNowhere_m;
  if (way.z() < 0) at_m = (storey.floor_m - from.z()) / way.z();
  if (way.z() > 0 && storey.ceiling_m) at_m = (*storey.ceiling_m - from.z()) / way.z();
  if (at_m >= meeting->likely_m) return;
  meeting->likely_m = at_m;
  meeting->likely = -1;
}

Meeting Meet(const Building& building, const std::vector<Screen>& screens, const Vector3d& from,
             const Vector3d& way) {
  Meeting meeting;
  for (size_t i = 0; i < screens.size(); ++i) {
    MeetScreen(screens[i], static_cast<int>(i), from, way, &meeting);
  }
  for (const Storey& storey : building.storeys) MeetStorey(storey, from, way, &meeting);
  return meeting;
}

// A cell of an image.
struct SeenCell {
  Vector3d way = Vector3d::UnitZ();  // of its ray, in world, at depth 1
  float front_z_m = std::numeric_limits<float>::infinity();
  float back_z_m = std::numeric_limits<float>::infinity();
  size_t point = 0;     // at the front
  bool is_true = true;  // the image shows the building there
};

// A place that was seen.
struct SeenPlace {
  Vector3d p_world = Vector3d::Zero(), way = Vector3d::UnitZ();  // unit, from the camera
  bool is_held = false;
  int screen = -1;  // whose plane it is on
};

class SeenImage {
 public:
  SeenImage(const ViewCameras& rig, const RigidTransform& T_camera_world)
      : camera_(rig.cameras[0]),
        T_camera_world_(T_camera_world),
        centre_(T_camera_world.Inverse().translation),
        columns_(camera_.width_px / kCell_px),
        rows_(camera_.height_px / kCell_px),
        cells_(static_cast<size_t>(columns_) * rows_) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const Eigen::Vector2d px((column + 0.5) * kCell_px - 0.5, (row + 0.5) * kCell_px - 0.5);
        SeenCell& cell = At(column, row);
        cell.way = T_camera_world.rotation.conjugate() *
                   Vector3d(PlaneFromPixel(camera_, px).homogeneous());
        cell.is_true = rig.left_mask.empty() ||
                       rig.left_mask.at<uchar>(static_cast<int>(px.y()), static_cast<int>(px.x()));
      }
    }
  }

  // What the points of the map cover.
  void Render(const MapResult& map) {
    const Eigen::Matrix3d R = T_camera_world_.rotation.toRotationMatrix();
    for (size_t i = 0; i < CountDense(map); ++i) {
      const DensePoint& point = DenseAt(map, i);
      const Vector3d ray = point.p_world - centre_;
      const double z_m = R.row(2).dot(ray);
      if (z_m < kNearest_m || z_m > kRange_m) continue;
      Cover(R * ray, point.normal_world.dot(ray) < 0, i);
    }
  }

  // What was seen of the map and of the building's planes.
  std::vector<SeenPlace> Places(const MapResult& map, const std::vector<Screen>& screens) const {
    std::vector<SeenPlace> places;
    std::vector<double> ranges_m(cells_.size(), kNowhere_m);
    std::vector<size_t> open;
    for (size_t i = 0; i < cells_.size(); ++i) {
      if (!cells_[i].is_true) continue;
      SeenPlace place;
      place.way = cells_[i].way.normalized();
      const Meeting meeting = Meet(map.building, screens, centre_, place.way);
      if (Holds(cells_[i], meeting)) {
        place.p_world = DenseAt(map, cells_[i].point).p_world;
        place.is_held = true;
        place.screen = meeting.sure;
        ranges_m[i] = (place.p_world - centre_).norm();
      } else if (Lacks(cells_[i], meeting, &ranges_m[i], &place.screen)) {
        place.p_world = centre_ + ranges_m[i] * place.way;
      } else {
        if (IsOpen(cells_[i], meeting)) open.push_back(i);
        continue;
      }
      if (ranges_m[i] <= kRange_m) places.push_back(place);
    }
    for (const size_t i : open) {
      const Vector3d way = cells_[i].way.normalized();
      const double range_m = RangeAround(ranges_m, static_cast<int>(i));
      if (range_m <= kRange_m) places.push_back({centre_ + range_m * way, way, false, -1});
    }
    return places;
  }

 private:
  static constexpr double kNearest_m = 0.2;

  SeenCell& At(int column, int row) { return cells_[row * columns_ + column]; }

  void Cover(const Vector3d& p_camera, bool is_front, size_t point) {
    const Eigen::Vector2d px = PixelFromPlane(camera_, Eigen::Vector2d(p_camera.hnormalized()));
    const double half_px = (is_front ? kHeld_m : kBack_m) * camera_.fx_px / p_camera.z();
    const auto cell = [](double at_px) { return (at_px + 0.5) / kCell_px - 0.5; };
    const int left = std::max(0, static_cast<int>(std::ceil(cell(px.x() - half_px))));
    const int right = std::min(columns_ - 1, static_cast<int>(std::floor(cell(px.x() + half_px))));
    const int top = std::max(0, static_cast<int>(std::ceil(cell(px.y() - half_px))));
    const int bottom = std::min(rows_ - 1, static_cast<int>(std::floor(cell(px.y() + half_px))));
    const auto z_m = static_cast<float>(p_camera.z());
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        SeenCell& seen = At(column, row);
        float& nearest_m = is_front ? seen.front_z_m : seen.back_z_m;
        if (z_m >= nearest_m) continue;
        nearest_m = z_m;
        if (is_front) seen.point = point;
      }
    }
  }

  static double Front_m(const SeenCell& cell) { return cell.front_z_m * cell.way.norm(); }
  static double Barred_m(const SeenCell& cell, const Meeting& meeting) {
    return std::min(meeting.sure_m, cell.back_z_m * cell.way.norm() - kThin_m);
  }

  static bool Holds(const SeenCell& cell, const Meeting& meeting) {
    return std::isfinite(cell.front_z_m) && Barred_m(cell, meeting) > Front_m(cell) - kBefore_m;
  }

  static bool Lacks(const SeenCell& cell, const Meeting& meeting, double* range_m, int* screen) {
    double at_m = Barred_m(cell, meeting);
    *screen = at_m == meeting.sure_m ? meeting.sure : -1;
    if (!std::isfinite(cell.front_z_m) && meeting.likely_m < at_m) {
      at_m = meeting.likely_m;
      *screen = meeting.likely;
    }
    if (!std::isfinite(at_m) || meeting.window_m < at_m) return false;
    *range_m = at_m;
    return true;
  }

  // Nothing is known of it.
  static bool IsOpen(const SeenCell& cell, const Meeting& meeting) {
    return !std::isfinite(cell.front_z_m) && !std::isfinite(meeting.window_m);
  }

  // The harmonic mean of what is nearest in the image on most sides; else infinite.
  double RangeAround(const std::vector<double>& ranges_m, int cell) const {
    constexpr std::array<std::pair<int, int>, 4> kSides = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    double inverse = 0;
    int found = 0;
    for (const auto& [across, down] : kSides) {
      int column = cell % columns_ + across, row = cell / columns_ + down;
      while (column >= 0 && row >= 0 && column < columns_ && row < rows_) {
        const double range_m = ranges_m[row * columns_ + column];
        column += across;
        row += down;
        if (!std::isfinite(range_m)) continue;
        inverse += 1 / range_m;
        ++found;
        break;
      }
    }
    return found >= kAroundNeeded ? found / inverse : kNowhere_m;
  }

  const Camera& camera_;
  const RigidTransform& T_camera_world_;
  const Vector3d centre_;
  const int columns_, rows_;
  std::vector<SeenCell> cells_;
};

// The left images that are looked at, of all rigs.
std::vector<std::pair<const ViewCameras*, const RigidTransform*>> ImagesToLookAt(
    const std::vector<ViewCameras>& watchers) {
  std::vector<std::pair<const ViewCameras*, const RigidTransform*>> apart, some;
  for (const ViewCameras& rig : watchers) {
    const RigidTransform* last = nullptr;
    for (const auto& [left, right] : rig.T_camera_world) {
      const RigidTransform step = last ? left * last->Inverse() : RigidTransform();
      if (last && step.translation.norm() < kApart_m &&
          LogRotation(step.rotation).norm() < kTurnedApart_rad) {
        continue;
      }
      last = &left;
      apart.emplace_back(&rig, &left);
    }
  }
  const size_t every = apart.size() / kMostViews + 1;
  for (size_t i = 0; i < apart.size(); i += every) some.push_back(apart[i]);
  return some;
}

// Counts voxels, each once.
class ShareTally {
 public:
  ShareTally(const MapResult& map, const std::vector<Screen>& screens)
      : map_(map), screens_(screens), index_(kHeld_m) {
    for (size_t i = 0; i < CountDense(map); ++i) index_.Add(DenseAt(map, i).p_world, i);
  }

  void Add(const SeenPlace& place) {
    const int64_t key = MakeKey(FindCube(place.p_world, kVoxel_m));
    const auto known = voxels_.find(key);
    if (known != voxels_.end() && (known->second.is_held || !place.is_held)) return;
    if (!place.is_held && IsHeldBeside(place)) return;
    const bool is_on =
        place.screen >= 0 &&
        std::abs(screens_[place.screen].plane.grid.DistanceTo(place.p_world)) < kOnWall_m;
    voxels_[key] = {place.is_held, RoomAt(place.p_world - kThin_m * place.way),
                    is_on ? screens_[place.screen].wall : -1};
  }

  void SetShares(MapResult* map) const {
    Counts all;
    std::vector<Counts> rooms(map->building.rooms.size()), walls(map->building.walls.size());
    for (const auto& [key, voxel] : voxels_) {
      all.Add(voxel);
      if (voxel.room >= 0) rooms[voxel.room].Add(voxel);
      if (voxel.wall >= 0) walls[voxel.wall].Add(voxel);
    }
    map->seen_share = all.Share();
    for (size_t i = 0; i < rooms.size(); ++i) map->building.rooms[i].seen_share = rooms[i].Share();
    for (size_t i = 0; i < walls.size(); ++i) map->building.walls[i].seen_share = walls[i].Share();
  }

 private:
  struct Voxel {
    bool is_held = false;
    int room = -1, wall = -1;
  };
  struct Counts {
    int64_t seen = 0, held = 0;
    void Add(const Voxel& voxel) {
      ++seen;
      held += voxel.is_held ? 1 : 0;
    }
    std::optional<double> Share() const {
      if (static_cast<double>(seen) * kVoxel_m * kVoxel_m < kLeastSeen_m2) return std::nullopt;
      return static_cast<double>(held) / static_cast<double>(seen);
    }
  };

  // By a point that the ray met from another view, or beside which it went.
  bool IsHeldBeside(const SeenPlace& place) const {
    return index_.AnyNear(place.p_world, kHeld_m, [&](size_t i) {
      return DenseAt(map_, i).normal_world.dot(place.way) < 0;
    });
  }

  int RoomAt(const Vector3d& p) const {
    constexpr double kBeyond_m = 0.3, kUnknownHeight_m = 3;
    const std::vector<Room>& rooms = map_.building.rooms;
    for (size_t i = 0; i < rooms.size(); ++i) {
      const double above_m = p.z() - rooms[i].floor_m;
      if (above_m < -kBeyond_m ||
          above_m > rooms[i].height_m.value_or(kUnknownHeight_m) + kBeyond_m) {
        continue;
      }
      if (Contains(rooms[i].polygon, p.head<2>())) return static_cast<int>(i);
    }
    return -1;
  }

  const MapResult& map_;
  const std::vector<Screen>& screens_;
  PointIndex index_;
  std::unordered_map<int64_t, Voxel> voxels_;
};

}  // namespace

void MeasureSeenShare(const SeenFrom& seen, const PlaneOptions& options, const Progress& progress,
                      MapResult* map) {
  constexpr double kScreened = 0.2;  // share of the time, about
  constexpr size_t kAtOnce = 16;     // views
  map->seen_share.reset();
  const std::vector<Screen> screens =
      MakeScreens(map->building, seen.rays, options, progress.Part(0, kScreened));
  const auto images = ImagesToLookAt(seen.watchers);
  std::vector<std::vector<SeenPlace>> places(images.size());
  const auto look = [&](size_t i) {
    SeenImage image(*images[i].first, *images[i].second);
    image.Render(*map);
    places[i] = image.Places(*map, screens);
  };
  if (!ForEachWatched(images.size(), progress.Part(kScreened, 1), look, kAtOnce)) return;
  ShareTally tally(*map, screens);
  for (const std::vector<SeenPlace>& of_image : places) {
    for (const SeenPlace& place : of_image) tally.Add(place);
  }
  tally.SetShares(map);
}

namespace {

std::string PoorestRooms(const Building& building) {
  std::vector<std::pair<double, int64_t>> poor;
  for (const Room& room : building.rooms) {
    if (room.seen_share.value_or(1) < kLeastShare) poor.emplace_back(*room.seen_share, room.id);
  }
  std::ranges::sort(poor);
  if (poor.size() > kNamedRooms) poor.resize(kNamedRooms);
  std::string text;
  for (const auto& [share, id] : poor) {
    text += fmt::format("{}room {}: {:.0f} %", text.empty() ? "; " : ", ", id + 1, 100 * share);
  }
  return text;
}

// What the verdict says of anything else.
Verdict WithoutSeenShare(const Verdict& verdict) {
  Verdict others;
  for (const VerdictReason& reason : verdict.reasons) {
    if (reason.what != kSeenShareReason) others.Add(reason);
  }
  return others;
}

}  // namespace

void JudgeSeenShare(MapResult* map) {
  if (map->verdict) map->verdict = WithoutSeenShare(*map->verdict);
  // On poses by anyone there is no verdict otherwise.
  const bool is_of_run = map->method != kExternalPoses;
  if (map->verdict && map->verdict->reasons.empty() && !is_of_run) map->verdict.reset();
  if (map->seen_share.value_or(1) >= kLeastShare) return;
  if (!map->verdict) map->verdict.emplace();
  map->verdict->Add({VerdictLevel::kDoubtful, kSeenShareReason,
                     fmt::format("a map with {:.0f} % of the surfaces that were seen{}",
                                 100 * *map->seen_share, PoorestRooms(map->building)),
                     fmt::format("at least {:.0f} %", 100 * kLeastShare),
                     "go there again, nearer to walls and furniture and with more light"});
}

}  // namespace slcmap::mapping
