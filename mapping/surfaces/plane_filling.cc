#include "mapping/surfaces/plane_filling.h"

#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/core/parallel.h"
#include "mapping/building/free_space.h"
#include "mapping/map/point_index.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/plane_views.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kStoreyReach_m = 1.5;  // the same at a storey's heights, where no room was found
// Where what is around is not on one surface, as it is little: on the plane itself.
constexpr double kBlankReach_m = 3;  // of walls: from points and lines in the plane, along it
constexpr double kFilledMaxSigma_m = 0.04;  // of the plane
constexpr int kMaxPasses = 2;               // rays that may be measured through a cell

constexpr double kAssumedHeight_m = 2.4;  // of a storey whose ceiling was not seen
constexpr double kWall_m = 0.3;           // from a room, that its wall may take
constexpr double kSigma_m = 0.03;         // of what is filled: as far from the plane it may be
constexpr double kReach_m = 60;           // of rays from their cameras
constexpr double kMaxCells = 4e7;

double TopOf_m(const Storey& storey) {
  return storey.ceiling_m.value_or(storey.floor_m + kAssumedHeight_m);
}

// Calls use(way) for the free parts of rays in a storey.
template <typename Use>
void ForEachWay(const Storey& storey, const std::vector<ViewRays>& seen, double cell_m,
                const Progress& progress, Use use) {
  const FreeSpaceRays rays(seen);
  rays.ForSomeViews(progress.Part(0, 0), [&](size_t begin, size_t end_view) {
    for (size_t view = begin; view < end_view; ++view) {
      rays.ForEachIn(view, [&](const Vector3d& camera, const Vector3d& end, double sigma_m) {
        if ((end - camera).norm() > kReach_m) return;
        const auto way = FindFreeWay(camera, end, sigma_m, storey.floor_m, TopOf_m(storey), cell_m);
        if (way) use(*way);
      });
    }
  });
}

struct RoomBox {
  const Room* room = nullptr;
  Eigen::AlignedBox2d box;
};

std::vector<RoomBox> MakeRoomBoxes(const Building& building, const Storey& storey) {
  std::vector<RoomBox> rooms;
  for (const Room& room : building.rooms) {
    if (room.storey != storey.id) continue;
    rooms.push_back({&room, {}});
    for (const Vector2d& p : room.polygon.outline) rooms.back().box.extend(p);
  }
  return rooms;
}

// By cell of a floor's grid: rays went over it, and no room is there or next to it.
cv::Mat1b OutsideRooms(const Building& building, const Storey& storey, const FreeSpace& free,
                       const PlaneGrid& grid, const Progress& progress) {
  cv::Mat1b of_rooms(grid.rows, grid.columns, uchar{0});
  cv::Mat1b outside = of_rooms.clone();
  const std::vector<RoomBox> rooms = MakeRoomBoxes(building, storey);
  for (int row = 0; row < grid.rows; ++row) {
    if (row % 64 == 0) progress.ReportOrStop(0);
    for (int column = 0; column < grid.columns; ++column) {
      const Vector2d p = grid.At(column + 0.5, row + 0.5).head<2>();
      outside(row, column) = free.IsFree(p) ? 1 : 0;
      of_rooms(row, column) = std::ranges::any_of(rooms, [&](const RoomBox& room) {
        return room.box.contains(p) && Contains(room.room->polygon, p);
      });
    }
  }
  const int wall_cells = static_cast<int>(std::lround(kWall_m / grid.cell_m));
  cv::dilate(
      of_rooms, of_rooms,
      cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * wall_cells + 1, 2 * wall_cells + 1)));
  outside.setTo(0, of_rooms);
  return outside;
}

// Looked at from below: rows run the other way.
BoundedPlane CeilingOver(const BoundedPlane& floor, double ceiling_m) {
  BoundedPlane ceiling = floor;
  PlaneGrid& grid = ceiling.grid;
  grid.normal = -Vector3d::UnitZ();
  grid.v = -Vector3d::UnitY();
  grid.offset_m = -ceiling_m;
  grid.from_v_m = -(floor.grid.from_v_m + floor.grid.rows * grid.cell_m);
  cv::flip(floor.inside, ceiling.inside, 0);
  return ceiling;
}

}  // namespace

std::vector<BoundedPlane> StoreyPlanes(const Building& building, const std::vector<ViewRays>& rays,
                                       const PlaneOptions& options, const Progress& progress) {
  std::vector<BoundedPlane> planes;
  for (const Storey& storey : building.storeys) {
    Eigen::AlignedBox2d box;
    ForEachWay(storey, rays, options.cell_m, progress,
               [&](const FreeWay& way) { box.extend(way.from).extend(way.to); });
    if (box.isEmpty()) continue;
    if (box.volume() > kMaxCells * options.cell_m * options.cell_m) {
      spdlog::warn("a storey of {:.0f} by {:.0f} m is too large to be filled beyond its rooms",
                   box.sizes().x(), box.sizes().y());
      continue;
    }
    FreeSpace free(box, options.cell_m);
    ForEachWay(storey, rays, options.cell_m, progress,
               [&](const FreeWay& way) { free.AddWay(way.from, way.to); });
    PlaneGrid grid;  // along x and y
    grid.offset_m = storey.floor_m;
    grid.cell_m = options.cell_m;
    grid.Cover(box);
    const BoundedPlane floor{grid,     OutsideRooms(building, storey, free, grid, progress),
                             kSigma_m, kStoreyReach_m,
                             false,    false};
    planes.push_back(floor);
    if (storey.ceiling_m) planes.push_back(CeilingOver(floor, *storey.ceiling_m));
  }
  return planes;
}

namespace {

constexpr double kIndex_m = 0.05;       // edges of the cubes that points are looked up in
constexpr double kMeasured_m = 0.04;    // from a measured point, nothing is filled
constexpr double kSamePlace_m = 0.025;  // of points of two planes that are one

// A view in which a gap between points lets a place be seen is enough for it: points stand for so
// much more of a surface than they are apart.
constexpr double kPieces = 1.5;

// Shares of the time, about.
constexpr double kMeasuredSeen = 0.2, kFilledUntil = 0.7, kFilledSeen = 0.9;

// The views of a building's rigs, and what hides places from them.
class WatchingViews {
 public:
  explicit WatchingViews(const std::vector<ViewCameras>& cameras)
      : cameras_(cameras), depths_(cameras.size()) {}

  // Surfaces of which points are so far apart hide what is behind them, from now on.
  void AddHiding(const std::vector<DensePoint>& surfaces, double apart_m,
                 const Progress& progress) {
    const auto count = static_cast<double>(cameras_.size());
    for (size_t rig = 0; rig < cameras_.size(); ++rig) {
      const auto i = static_cast<double>(rig);
      depths_[rig].emplace_back(surfaces, kPieces * apart_m, cameras_[rig],
                                progress.Part(i / count, (i + 1) / count));
    }
  }

  // One of each rig, for one thread.
  std::vector<PlaneWatch> Watches() const {
    std::vector<PlaneWatch> watches;
    for (size_t rig = 0; rig < cameras_.size(); ++rig) {
      watches.emplace_back(cameras_[rig], depths_[rig]);
    }
    return watches;
  }

 private:
  const std::vector<ViewCameras>& cameras_;
  std::vector<std::vector<VisibilityDepths>> depths_;  // by rig
};

bool AnySees(std::vector<PlaneWatch>* watches, const Vector3d& p, const Vector3d& normal) {
  return std::ranges::any_of(*watches, [&](PlaneWatch& watch) { return watch.Sees(p, normal); });
}

// What is around a place of a plane, if it is on one surface, else the plane where that is known.
std::optional<SurfaceAround> SurfaceAt(const BoundedPlane& plane, const MeasuredAround& around,
                                       const PlaneBorders& borders, const Vector2d& cell) {
  const auto reaches = [&](const std::optional<SurfaceAround>& surface, double reach_m) {
    return surface && surface->nearest_m <= reach_m &&
           std::abs(surface->offset_m) <= kFilledMaxOffset_m &&
           !borders.Part(cell, surface->nearest);
  };
  auto surface = around.At(cell.x(), cell.y());
  if (reaches(surface, plane.reach_m)) return surface;
  if (!plane.is_measured || plane.sigma_m > kFilledMaxSigma_m) return std::nullopt;
  surface = around.OnPlane(cell.x(), cell.y());
  const double reach_m = plane.is_wall ? kBlankReach_m : plane.reach_m;
  return reaches(surface, reach_m) ? surface : std::nullopt;
}

std::vector<DensePoint> Filled(const BoundedPlane& plane, const MeasuredBuilding& measured,
                               const PointIndex& index, const WatchingViews& watching,
                               const PlaneOptions& options) {
  const PlaneGrid& grid = plane.grid;
  const MeasuredAround around(grid, measured.dense, measured.lines, options.beside_m);
  const PlaneBorders borders =
      plane.is_wall ? PlaneBorders(grid, measured.lines, options.beside_m) : PlaneBorders();
  const cv::Mat1i passes = CountPasses(grid, measured.rays);
  std::vector<PlaneWatch> watches = watching.Watches();
  std::vector<DensePoint> points;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!plane.inside(row, column) || passes(row, column) > kMaxPasses) continue;
      const auto surface = SurfaceAt(plane, around, borders, {column + 0.5, row + 0.5});
      if (!surface) continue;
      const Vector3d p = grid.At(column + 0.5, row + 0.5) + surface->offset_m * grid.normal;
      if (index.HasNear(p, kMeasured_m) || !AnySees(&watches, p, grid.normal)) continue;
      points.push_back(
          {p, grid.normal, plane.sigma_m, static_cast<uint8_t>(std::lround(surface->grey))});
    }
  }
  return points;
}

// None once progress says so.
std::vector<BoundedPlane> PlanesToFill(const MeasuredBuilding& measured,
                                       const PlaneOptions& options, const Progress& progress) {
  std::vector<BoundedPlane> planes = BoundedPlanes(measured.building, options);
  try {
    const std::vector<BoundedPlane> beyond =
        StoreyPlanes(measured.building, measured.rays, options, progress.Part(0, 0));
    planes.insert(planes.end(), beyond.begin(), beyond.end());
  } catch (const StoppedError&) {
    planes.clear();
  }
  return planes;
}

// Of planes that overlap, the first's.
std::vector<DensePoint> FirstOfEach(const std::vector<std::vector<DensePoint>>& by_plane) {
  PointIndex taken(kIndex_m);
  std::vector<DensePoint> points;
  for (const std::vector<DensePoint>& filled : by_plane) {
    for (const DensePoint& point : filled) {
      const bool is_taken = taken.AnyNear(point.p_world, kSamePlace_m, [&](size_t i) {
        return points[i].normal_world.dot(point.normal_world) > 0;
      });
      if (is_taken) continue;
      taken.Add(point.p_world, points.size());
      points.push_back(point);
    }
  }
  return points;
}

// By plane. None once progress says so.
std::vector<std::vector<DensePoint>> FillEach(const MeasuredBuilding& measured,
                                              const std::vector<BoundedPlane>& planes,
                                              const WatchingViews& watching,
                                              const PlaneOptions& options,
                                              const Progress& progress) {
  PointIndex index(kIndex_m);
  for (size_t i = 0; i < measured.dense.size(); ++i) index.Add(measured.dense[i].p_world, i);
  std::vector<std::vector<DensePoint>> filled(planes.size());
  const auto fill = [&](size_t i) {
    filled[i] = Filled(planes[i], measured, index, watching, options);
  };
  if (!ForEachWatched(planes.size(), progress, fill, 8)) return {};
  return filled;
}

// Of points those that some view sees. None once progress says so.
std::vector<DensePoint> SelectSeen(const std::vector<DensePoint>& points,
                                   const WatchingViews& watching, const Progress& progress) {
  constexpr size_t kJob = 200;  // points
  std::vector<char> is_seen(points.size());
  const auto look = [&](size_t job) {
    std::vector<PlaneWatch> watches = watching.Watches();
    for (size_t i = job * kJob; i < std::min(points.size(), (job + 1) * kJob); ++i) {
      is_seen[i] = AnySees(&watches, points[i].p_world, points[i].normal_world) ? 1 : 0;
    }
  };
  if (!ForEachWatched((points.size() + kJob - 1) / kJob, progress, look, 10)) return {};
  std::vector<DensePoint> seen;
  for (size_t i = 0; i < points.size(); ++i) {
    if (is_seen[i]) seen.push_back(points[i]);
  }
  return seen;
}

}  // namespace

std::vector<DensePoint> FillPlanes(const MeasuredBuilding& measured, const PlaneOptions& options,
                                   const Progress& progress) {
  options.Check();
  const std::vector<BoundedPlane> planes = PlanesToFill(measured, options, progress);
  if (planes.empty()) return {};
  WatchingViews watching(measured.watchers);
  watching.AddHiding(measured.dense, measured.voxel_m, progress.Part(0, kMeasuredSeen));
  const std::vector<DensePoint> filled = FirstOfEach(
      FillEach(measured, planes, watching, options, progress.Part(kMeasuredSeen, kFilledUntil)));
  // A blank wall, which is not measured, hides the rooms behind it.
  watching.AddHiding(filled, options.cell_m, progress.Part(kFilledUntil, kFilledSeen));
  std::vector<DensePoint> seen = SelectSeen(filled, watching, progress.Part(kFilledSeen, 1));
  if (!progress.Report(1)) return {};
  return seen;
}

}  // namespace slcmap::mapping
