#include "mapping/planes/plane_filling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mapping/dense/parallel.h"
#include "mapping/planes/bounded_plane.h"
#include "mapping/planes/measured_around.h"
#include "mapping/planes/plane_borders.h"
#include "mapping/planes/plane_rays.h"
#include "mapping/planes/point_index.h"
#include "mapping/planes/storey_planes.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kIndex_m = 0.05;       // edges of the cubes that points are looked up in
constexpr double kMeasured_m = 0.04;    // from a measured point, nothing is filled
constexpr double kSamePlace_m = 0.025;  // of points of two planes that are one
constexpr double kMinDepth_m = 0.3;     // of a place from a camera
constexpr double kMargin_px = 2;        // of the image's border

// Whether views of a rig look at places of a plane. Neighbouring places are seen by the same view,
// which is asked first.
class Watch {
 public:
  Watch(const Watchers& watchers, const Vector3d& normal, const PlaneOptions& options)
      : cameras_(watchers.cameras), depths_(watchers.depths), normal_(normal), options_(options) {
    for (size_t view = 0; view < cameras_.T_camera_world.size(); ++view) {
      centres_.push_back(cameras_.Centre(static_cast<int>(view)));
    }
  }

  bool Sees(const Vector3d& p) {
    const int count = static_cast<int>(centres_.size());
    for (int i = 0; i < count; ++i) {
      const int view = (last_ + i) % count;
      if (!SeesFrom(view, p)) continue;
      last_ = view;
      return true;
    }
    return false;
  }

 private:
  bool SeesFrom(int view, const Vector3d& p) const {
    const Vector3d way = centres_[view] - p;
    const double range_m = way.norm();
    if (range_m > options_.max_range_m || normal_.dot(way) < min_cosine_ * range_m) return false;
    const Vector3d p_camera = cameras_.T_camera_world[view][0] * p;
    if (p_camera.z() < kMinDepth_m) return false;
    const Vector2d px = PixelFromPlane(cameras_.cameras[0], Vector2d(p_camera.hnormalized()));
    return cameras_.cameras[0].Contains(px, kMargin_px) &&
           !depths_.Hides(view, 0, px, p_camera.z());
  }

  const ViewCameras& cameras_;
  const SightDepths& depths_;
  const Vector3d normal_;
  const PlaneOptions& options_;
  const double min_cosine_ = std::cos(options_.max_grazing_deg * std::numbers::pi / 180);
  std::vector<Vector3d> centres_;
  int last_ = 0;
};

// What is around a place of a plane, if it is on one surface, else the plane where that is known.
std::optional<SurfaceAround> SurfaceAt(const BoundedPlane& plane, const MeasuredAround& around,
                                       const PlaneBorders& borders, const Vector2d& cell,
                                       const PlaneOptions& options) {
  const auto reaches = [&](const std::optional<SurfaceAround>& surface, double reach_m) {
    return surface && surface->nearest_m <= reach_m &&
           std::abs(surface->offset_m) <= options.max_offset_m &&
           !borders.Part(cell, surface->nearest);
  };
  auto surface = around.At(cell.x(), cell.y());
  if (reaches(surface, plane.reach_m)) return surface;
  if (!plane.is_measured || plane.sigma_m > options.max_sigma_m) return std::nullopt;
  surface = around.OnPlane(cell.x(), cell.y());
  const double reach_m = plane.is_wall ? options.blank_reach_m : plane.reach_m;
  return reaches(surface, reach_m) ? surface : std::nullopt;
}

std::vector<DensePoint> Filled(const BoundedPlane& plane, const MeasuredBuilding& measured,
                               const PointIndex& index, const PlaneOptions& options) {
  const PlaneGrid& grid = plane.grid;
  const MeasuredAround around(grid, measured.dense, measured.lines, options);
  const PlaneBorders borders =
      plane.is_wall ? PlaneBorders(grid, measured.lines, options.beside_m) : PlaneBorders();
  const cv::Mat1i passes = CountPasses(grid, measured.sights, options);
  std::vector<Watch> watches;
  for (const Watchers& watchers : measured.watchers) {
    watches.emplace_back(watchers, grid.normal, options);
  }
  const auto is_seen = [&](const Vector3d& p) {
    return std::any_of(watches.begin(), watches.end(), [&](Watch& watch) { return watch.Sees(p); });
  };
  std::vector<DensePoint> points;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!plane.inside(row, column) || passes(row, column) > options.max_passes) continue;
      const auto surface = SurfaceAt(plane, around, borders, {column + 0.5, row + 0.5}, options);
      if (!surface) continue;
      const Vector3d p = grid.At(column + 0.5, row + 0.5) + surface->offset_m * grid.normal;
      if (index.HasNear(p, kMeasured_m) || !is_seen(p)) continue;
      points.push_back({p, grid.normal, plane.sigma_m,
                        static_cast<uint8_t>(std::lround(surface->grey)),
                        DenseSource::kFilledPlane});
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
        StoreyPlanes(measured.building, measured.sights, options, progress.Part(0, 0));
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

}  // namespace

std::vector<DensePoint> FillPlanes(const MeasuredBuilding& measured, const PlaneOptions& options,
                                   int threads, const Progress& progress) {
  options.Check();
  const std::vector<BoundedPlane> planes = PlanesToFill(measured, options, progress);
  PointIndex index(kIndex_m);
  for (size_t i = 0; i < measured.dense.size(); ++i) index.Add(measured.dense[i].p_world, i);
  std::vector<std::vector<DensePoint>> filled(planes.size());
  constexpr size_t kAtOnce = 8;  // planes, between which it may be ended
  for (size_t begin = 0; begin < planes.size(); begin += kAtOnce) {
    if (!progress.Report(static_cast<double>(begin) / static_cast<double>(planes.size()))) {
      return {};
    }
    ParallelFor(begin, std::min(planes.size(), begin + kAtOnce), threads,
                [&](size_t i) { filled[i] = Filled(planes[i], measured, index, options); });
  }
  return FirstOfEach(filled);
}

}  // namespace slcmap
