#include "mapping/planes/storey_planes.h"

#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/building/free_space.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAssumedHeight_m = 2.4;  // of a storey whose ceiling was not seen
constexpr double kWall_m = 0.3;           // from a room, that its wall may take
constexpr double kSigma_m = 0.03;         // of what is filled: as far from the plane it may be
constexpr double kReach_m = 60;           // of rays from their cameras
constexpr size_t kMaxRays = 2000000;      // looked at
constexpr double kMaxCells = 4e7;

double TopOf_m(const Storey& storey) {
  return storey.ceiling_m.value_or(storey.floor_m + kAssumedHeight_m);
}

// Calls use(way) for the free parts of rays in a storey.
template <typename Use>
void ForEachWay(const Storey& storey, const std::vector<Sights>& sights, double cell_m,
                const Progress& progress, Use use) {
  const SightRays rays(sights, kMaxRays);
  rays.ForSomeViews(progress.Part(0, 0), [&](size_t begin, size_t end_view) {
    for (size_t view = begin; view < end_view; ++view) {
      rays.ForEachOf(view, [&](const Vector3d& camera, const Vector3d& end, double sigma_m) {
        if ((end - camera).norm() > kReach_m) return;
        const auto way = FreeWayOf(camera, end, sigma_m, storey.floor_m, TopOf_m(storey), cell_m);
        if (way) use(*way);
      });
    }
  });
}

struct RoomBox {
  const Room* room = nullptr;
  Eigen::AlignedBox2d box;
};

std::vector<RoomBox> RoomsOf(const Building& building, const Storey& storey) {
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
  cv::Mat1b of_rooms = cv::Mat1b::zeros(grid.rows, grid.columns);
  cv::Mat1b outside = of_rooms.clone();
  const std::vector<RoomBox> rooms = RoomsOf(building, storey);
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

std::vector<BoundedPlane> StoreyPlanes(const Building& building, const std::vector<Sights>& sights,
                                       const PlaneOptions& options, const Progress& progress) {
  std::vector<BoundedPlane> planes;
  for (const Storey& storey : building.storeys) {
    Eigen::AlignedBox2d box;
    ForEachWay(storey, sights, options.cell_m, progress,
               [&](const FreeWay& way) { box.extend(way.from).extend(way.to); });
    if (box.isEmpty()) continue;
    if (box.volume() > kMaxCells * options.cell_m * options.cell_m) {
      spdlog::warn("a storey of {:.0f} by {:.0f} m is too large to be filled beyond its rooms",
                   box.sizes().x(), box.sizes().y());
      continue;
    }
    FreeSpace free(box, options.cell_m);
    ForEachWay(storey, sights, options.cell_m, progress,
               [&](const FreeWay& way) { free.AddWay(way.from, way.to); });
    PlaneGrid grid;  // along x and y
    grid.offset_m = storey.floor_m;
    grid.cell_m = options.cell_m;
    grid.Cover(box);
    const BoundedPlane floor{grid,     OutsideRooms(building, storey, free, grid, progress),
                             kSigma_m, options.storey_reach_m,
                             false,    false};
    planes.push_back(floor);
    if (storey.ceiling_m) planes.push_back(CeilingOver(floor, *storey.ceiling_m));
  }
  return planes;
}

}  // namespace slcmap
