#include "mapping/align/surface_union.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "data/core/error.h"
#include "mapping/dense/dense_map.h"
#include "mapping/dense/depth_fusion.h"
#include "mapping/lines/line_samples.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kLeastSigma_m = 0.001;
using PointVoxel = std::array<int64_t, 3>;

PointVoxel FindVoxel(const MapPoint& point, double voxel_m) {
  const auto index = [&](int i) {
    return static_cast<int64_t>(std::floor(point.p_world[i] / voxel_m));
  };
  return {index(0), index(1), index(2)};
}

// The points of a voxel.
struct PointSum {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double weight = 0;
  int observations = 0;
  int64_t index = 0;  // of their mean among the united points
  int tracks = 0;     // of their observations so far

  void Add(const MapPoint& point) {
    const double sigma_m = std::max(point.sigma_m, kLeastSigma_m), w = 1 / (sigma_m * sigma_m);
    p += w * point.p_world;
    weight += w;
    observations += point.observations;
  }
  MapPoint Mean() const { return {p / weight, 1 / std::sqrt(weight), observations, {}}; }
};

// Adds a map's observations as those of the points that its own went into.
template <typename SumOf>
void AddObservations(const UnitedPoints& map, const SumOf& sum_of,
                     std::vector<MapPointObservation>* united) {
  const MapPointObservation* before = nullptr;
  for (const MapPointObservation& seen : map.observations) {
    PointSum* sum = sum_of(map.points[static_cast<std::size_t>(seen.point)]);
    if (!before || before->point != seen.point || before->track != seen.track) ++sum->tracks;
    before = &seen;
    united->push_back({sum->index, sum->tracks - 1, seen.stamp_ns, seen.camera, seen.px});
  }
}

}  // namespace

std::vector<DensePoint> UniteSurfaces(const std::vector<DensePoint>& first,
                                      const std::vector<DensePoint>& second, double voxel_m) {
  DenseOptions options;
  options.voxel_m = voxel_m;
  DepthFusion fusion(options);
  for (const std::vector<DensePoint>* points : {&first, &second}) {
    for (const DensePoint& point : *points) fusion.Add(point);
  }
  return fusion.Points();
}

UnitedPoints UnitePoints(const UnitedPoints& first, const UnitedPoints& second, double voxel_m) {
  std::map<PointVoxel, PointSum> voxels;
  for (const UnitedPoints* map : {&first, &second}) {
    for (const MapPoint& point : map->points) voxels[FindVoxel(point, voxel_m)].Add(point);
  }
  UnitedPoints united;
  for (auto& [voxel, sum] : voxels) {
    sum.index = std::ssize(united.points);
    united.points.push_back(sum.Mean());
  }
  for (const UnitedPoints* map : {&first, &second}) {
    AddObservations(
        *map, [&](const MapPoint& p) { return &voxels.at(FindVoxel(p, voxel_m)); },
        &united.observations);
  }
  std::ranges::sort(united.observations, {},
                    [](const MapPointObservation& seen) { return MakeKey(seen); });
  return united;
}

namespace {

constexpr int kBlock = 8;  // cells of a side
// What buildings fill is far less; a damaged tree can call half of its world free.
constexpr double kMostBlocks = 2e6;

using Block = std::array<int, 3>;

// The blocks of cells that cubes lie in or touch.
void AddBlocks(const std::vector<Voxel>& voxels, const RigidTransform& T, double resolution_m,
               std::set<Block>* blocks) {
  const double block_m = kBlock * resolution_m;
  for (const Voxel& voxel : voxels) {
    const Eigen::Vector3d centre = T * voxel.centre_world;
    // Turned cubes reach farther than they are wide.
    const double reach_m = 0.5 * std::sqrt(3.0) * voxel.size_m;
    const Eigen::Vector3i from = ((centre.array() - reach_m) / block_m).floor().cast<int>();
    const Eigen::Vector3i to = ((centre.array() + reach_m) / block_m).floor().cast<int>();
    if (static_cast<double>(blocks->size()) + ((to - from).cast<double>().array() + 1).prod() >
        kMostBlocks) {
      throw DataError(fmt::format(
          "occupancy: found known space of more than {:.0f} m3, expected that of a building",
          kMostBlocks * block_m * block_m * block_m));
    }
    for (int x = from.x(); x <= to.x(); ++x) {
      for (int y = from.y(); y <= to.y(); ++y) {
        for (int z = from.z(); z <= to.z(); ++z) blocks->insert({x, y, z});
      }
    }
  }
}

enum class Cell { kUnknown, kFree, kOccupied };

Cell CellAt(const OccupancyMap& map, const Eigen::Vector3d& p) {
  if (map.IsOccupied(p)) return Cell::kOccupied;
  return map.IsFree(p) ? Cell::kFree : Cell::kUnknown;
}

Cell Both(Cell a, Cell b) {
  if (a == Cell::kFree || b == Cell::kFree) return Cell::kFree;
  return a == Cell::kOccupied || b == Cell::kOccupied ? Cell::kOccupied : Cell::kUnknown;
}

}  // namespace

OccupancyMap UniteOccupancy(const OccupancyMap& first, const OccupancyMap& second,
                            const RigidTransform& T_first_second,
                            const std::vector<DensePoint>& united, double spacing_m) {
  const double resolution_m = first.resolution_m();
  const RigidTransform T_second_first = T_first_second.Inverse();
  std::set<Block> blocks;
  for (const bool occupied : {false, true}) {
    const auto voxels = [&](const OccupancyMap& map) {
      return occupied ? map.OccupiedVoxels() : map.FreeVoxels();
    };
    AddBlocks(voxels(first), RigidTransform(), resolution_m, &blocks);
    AddBlocks(voxels(second), T_first_second, resolution_m, &blocks);
  }
  OccupancyMap map(resolution_m);
  for (const Block& block : blocks) {
    CellObservation cells;
    for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
      const OctreeCell cell(kBlock * block[0] + i % kBlock, kBlock * block[1] + i / kBlock % kBlock,
                            kBlock * block[2] + i / kBlock / kBlock);
      const Eigen::Vector3d centre = resolution_m * (cell.cast<double>().array() + 0.5);
      const Cell state = Both(CellAt(first, centre), CellAt(second, T_second_first * centre));
      if (state == Cell::kFree) cells.free.push_back(cell);
      if (state == Cell::kOccupied) cells.occupied.push_back(cell);
    }
    map.Mark(cells);
  }
  MarkSurfaces(united, spacing_m, &map);
  map.Finish();
  return map;
}

namespace {

constexpr int kVisibilityCell_px = 16;
constexpr double kNearest_m = 0.2, kFarthest_m = 10;
constexpr std::size_t kViewsAtOnce = 16;  // whose depth is in memory

// Whether a way leads through free space but for short parts, as beside surfaces, and its ends.
bool IsFreeWay(const OccupancyMap& occupancy, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to) {
  constexpr double kAtStart_m = 0.3, kAtEnd_m = 0.15, kMostBlocked_m = 0.2;
  const double length_m = (to - from).norm(), step_m = occupancy.resolution_m();
  double blocked_m = 0;
  for (double at_m = kAtStart_m; at_m < length_m - kAtEnd_m; at_m += step_m) {
    const bool is_free = occupancy.IsFree(from + at_m / length_m * (to - from));
    blocked_m = is_free ? 0 : blocked_m + step_m;
    if (blocked_m > kMostBlocked_m) return false;
  }
  return true;
}

struct NearestPoint {
  const DensePoint* point = nullptr;
  double depth_m = std::numeric_limits<double>::infinity();
};

class RaysOfView {
 public:
  RaysOfView(const RigidTransform& T_world_camera, const Camera& camera)
      : T_world_camera_(T_world_camera),
        R_camera_world_(T_world_camera.rotation.conjugate().toRotationMatrix()),
        camera_(camera) {}

  // Points that `hides` does not.
  template <typename Hides>
  ViewRays Of(const std::vector<DensePoint>& cloud, const OccupancyMap& occupancy,
              const Hides& hides) const {
    const int columns = camera_.width_px / kVisibilityCell_px,
              rows = camera_.height_px / kVisibilityCell_px;
    std::vector<NearestPoint> cells(static_cast<std::size_t>(columns) * rows);
    for (const DensePoint& point : cloud) {
      const Eigen::Vector3d ray = point.p_world - T_world_camera_.translation;
      if (ray.dot(point.normal_world) > 0) continue;
      const Eigen::Vector3d p = R_camera_world_ * ray;
      if (p.z() < kNearest_m || p.z() > kFarthest_m) continue;
      const Eigen::Vector2d px = PixelFromPlane(camera_, Eigen::Vector2d(p.hnormalized()));
      if (px.x() < 0 || px.y() < 0) continue;
      const int column = static_cast<int>(px.x()) / kVisibilityCell_px;
      const int row = static_cast<int>(px.y()) / kVisibilityCell_px;
      if (column >= columns || row >= rows) continue;
      NearestPoint& cell = cells[row * columns + column];
      if (p.z() < cell.depth_m && !hides(px, p.z())) cell = {&point, p.z()};
    }
    ViewRays rays;
    rays.p_world_camera = T_world_camera_.translation;
    for (const NearestPoint& cell : cells) {
      if (!cell.point) continue;
      if (!IsFreeWay(occupancy, rays.p_world_camera, cell.point->p_world)) continue;
      rays.p_world.push_back(cell.point->p_world.cast<float>());
      rays.sigma_m.push_back(static_cast<float>(cell.point->sigma_m));
    }
    return rays;
  }

 private:
  const RigidTransform T_world_camera_;
  const Eigen::Matrix3d R_camera_world_;
  const Camera& camera_;
};

// How far a point that a left camera shows is away at most.
double FarthestSeen_m(const Camera& camera) {
  double longest = 1;
  for (const double x_px : {0.0, static_cast<double>(camera.width_px)}) {
    for (const double y_px : {0.0, static_cast<double>(camera.height_px)}) {
      longest = std::max(longest,
                         PlaneFromPixel(camera, Eigen::Vector2d(x_px, y_px)).homogeneous().norm());
    }
  }
  return kFarthest_m * longest;
}

// The points that views can see at all: of a large building they are few.
std::vector<DensePoint> PointsNear(const Views& views, const Rig& rig,
                                   const std::vector<DensePoint>& cloud) {
  Eigen::AlignedBox3d box;
  for (const View& view : views) box.extend(WorldFromCamera(view, rig).translation);
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(FarthestSeen_m(rig.cameras[0]));
  const Eigen::AlignedBox3d near(box.min() - reach, box.max() + reach);
  std::vector<DensePoint> points;
  std::ranges::copy_if(cloud, std::back_inserter(points),
                       [&](const DensePoint& point) { return near.contains(point.p_world); });
  return points;
}

}  // namespace

std::vector<ViewRays> CollectCloudRays(const Trajectory& poses, const Rig& rig,
                                       const std::vector<DensePoint>& cloud, double size_m,
                                       const OccupancyMap& occupancy, const Progress& progress) {
  std::vector<ViewRays> rays;
  for (std::size_t first = 0; first < poses.size(); first += kViewsAtOnce) {
    progress.ReportOrStop(static_cast<double>(first) / static_cast<double>(poses.size()));
    Views views;
    for (std::size_t i = first; i < std::min(poses.size(), first + kViewsAtOnce); ++i) {
      views.push_back({poses[i].stamp_ns, 0, poses[i].T_world_imu});
    }
    const std::vector<DensePoint> near = PointsNear(views, rig, cloud);
    const VisibilityDepths depths(near, size_m, ViewCameras(views, rig));
    for (std::size_t i = 0; i < views.size(); ++i) {
      const RaysOfView view(WorldFromCamera(views[i], rig), rig.cameras[0]);
      rays.push_back(view.Of(near, occupancy, [&](const Eigen::Vector2d& px, double depth_m) {
        return depths.Hides(static_cast<int>(i), 0, px, depth_m);
      }));
    }
  }
  return rays;
}

namespace {

constexpr double kSameCentre_m = 0.005, kSameDirection_rad = 0.0175;

// From a camera's images into those of another one in the same place.
struct PixelMove {
  Camera from, to;
  Eigen::Quaterniond R_to_from;

  Eigen::Vector2d At(const Eigen::Vector2d& px) const {
    const Eigen::Vector3d ray = R_to_from * PlaneFromPixel(from, px).homogeneous();
    return PixelFromPlane(to, Eigen::Vector2d(ray.hnormalized()));
  }
};

// By camera.
std::vector<PixelMove> MovesBetween(const Rig& from, const Rig& to) {
  std::vector<PixelMove> moves;
  for (size_t i = 0; i < from.cameras.size(); ++i) {
    moves.push_back({from.cameras[i], to.cameras[i],
                     to.T_imu_camera[i].rotation.conjugate() * from.T_imu_camera[i].rotation});
  }
  return moves;
}

}  // namespace

bool IsSameRig(const Rig& a, const Rig& b) {
  if (a.cameras.size() != b.cameras.size()) return false;
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    const RigidTransform T = a.T_imu_camera[i].Inverse() * b.T_imu_camera[i];
    if (T.translation.norm() > kSameCentre_m) return false;
    if (LogRotation(T.rotation).norm() > kSameDirection_rad) return false;
  }
  return true;
}

std::vector<LineSupport> SupportsInRig(std::vector<LineSupport> supports, const Rig& from,
                                       const Rig& to) {
  const std::vector<PixelMove> moves = MovesBetween(from, to);
  for (LineSupport& support : supports) {
    const PixelMove& move = moves[support.camera];
    support.px = {move.At(support.px.start), move.At(support.px.end)};
  }
  return supports;
}

std::vector<MapPointObservation> ObservationsInRig(std::vector<MapPointObservation> observations,
                                                   const Rig& from, const Rig& to) {
  const std::vector<PixelMove> moves = MovesBetween(from, to);
  for (MapPointObservation& seen : observations) seen.px = moves[seen.camera].At(seen.px);
  return observations;
}

}  // namespace slcmap::mapping
