#include "mapping/dense/dense_map.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "data/core/error.h"
#include "data/core/parallel.h"
#include "mapping/dense/depth_fusion.h"
#include "mapping/map/rays.h"
#include "mapping/views/stereo_depth.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kPoseSigma_px = 0.15;  // what poses let the image of another view be off
constexpr int kNeighbours = 3;          // views whose images refine the depth of one
// What is kept.
constexpr int kWindowViews = 8;  // on either side, that may confirm a view's depth

constexpr double kFreeSigmas = 3;
constexpr double kMaxCells = 1 << 30;  // around a camera, a bit each

// Of a point in units of cells.
OctreeCell FindCell(const Eigen::Vector3d& p) { return p.array().floor().cast<int>(); }

template <typename Visit>
void ForEachKnown(const DepthGrid& grid, const Camera& camera, const Visit& visit) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const DepthNode& node = grid.At(column, row);
      if (!node.is_known()) continue;
      visit(node, PinholeRay(camera, grid.ColumnPixel(column), grid.RowPixel(row)));
    }
  }
}

// A bit for each cell around a camera.
class CellBlock {
 public:
  CellBlock(const OctreeCell& centre, int reach)
      : first_(centre.array() - reach), side_(2 * reach + 1) {
    marks_.resize(static_cast<std::size_t>(side_) * side_ * side_);
  }

  // Returns whether the cell was not marked before.
  bool Mark(const OctreeCell& cell) {
    const std::size_t index = Index(cell);
    if (marks_[index]) return false;
    marks_[index] = true;
    return true;
  }

 private:
  std::size_t Index(const OctreeCell& cell) const {
    const OctreeCell at = cell - first_;
    return (static_cast<std::size_t>(at.x()) * side_ + at.y()) * side_ + at.z();
  }

  const OctreeCell first_;
  const int side_;
  std::vector<bool> marks_;
};

// Visits the cells from one point to another, as J. Amanatides and A. Woo, "A fast voxel traversal
// algorithm for ray tracing", 1987; both in units of cells.
template <typename Visit>
void ForEachCell(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Visit& visit) {
  const Eigen::Vector3d way = to - from;
  OctreeCell cell = FindCell(from);
  const OctreeCell last = FindCell(to);
  Eigen::Vector3i step;
  Eigen::Vector3d next, gap;  // where the ray leaves the cell along each axis, and from there on
  for (int i = 0; i < 3; ++i) {
    step[i] = way[i] > 0 ? 1 : -1;
    const double border = cell[i] + (step[i] > 0 ? 1 : 0);
    const bool is_along = std::abs(way[i]) > 1e-12;
    gap[i] = is_along ? std::abs(1 / way[i]) : std::numeric_limits<double>::infinity();
    next[i] = is_along ? (border - from[i]) / way[i] : std::numeric_limits<double>::infinity();
  }
  visit(cell);
  for (int steps = (last - cell).cwiseAbs().sum(); steps > 0; --steps) {
    int axis = 0;
    next.minCoeff(&axis);
    cell[axis] += step[axis];
    next[axis] += gap[axis];
    visit(cell);
  }
}

}  // namespace

DepthCarver::DepthCarver(double resolution_m, double max_range_m)
    : resolution_m_(resolution_m), max_range_m_(max_range_m) {
  const double side = 2 * (max_range_m / resolution_m + 2) + 1;
  if (side * side * side <= kMaxCells) return;
  throw ConfigError(fmt::format(
      "mapping.occupancy.resolution_m: found {}, which takes {:.3g} cells around a camera up to "
      "mapping.occupancy.max_range_m, {} m; expected at least {:.2g}",
      resolution_m, side * side * side, max_range_m, 2.05 * max_range_m / std::cbrt(kMaxCells)));
}

double DepthCarver::Reach_m(const Camera& camera, const DepthGrid& grid) const {
  double reach_m = 0;
  ForEachKnown(grid, camera, [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    reach_m = std::max(reach_m, node.depth_m() * ray.norm());
  });
  return std::min(reach_m, max_range_m_);
}

CellObservation DepthCarver::Observe(const RigidTransform& T_world_camera, const Camera& camera,
                                     const DepthGrid& grid) const {
  const Eigen::Vector3d origin = T_world_camera.translation / resolution_m_;
  CellBlock marked(FindCell(origin), static_cast<int>(Reach_m(camera, grid) / resolution_m_) + 2);
  CellObservation observation;
  const auto mark_occupied = [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    if (node.depth_m() * ray.norm() > max_range_m_) return;
    const OctreeCell cell =
        FindCell(origin + node.depth_m() / resolution_m_ * (T_world_camera.rotation * ray));
    if (marked.Mark(cell)) observation.occupied.push_back(cell);
  };
  const auto mark_free = [&](const DepthNode& node, const Eigen::Vector3d& ray) {
    const double free_m =
        std::min(max_range_m_ / ray.norm(), node.depth_m() - kFreeSigmas * node.depth_sigma_m());
    if (free_m <= 0) return;
    const Eigen::Vector3d end = origin + free_m / resolution_m_ * (T_world_camera.rotation * ray);
    ForEachCell(origin, end, [&](const OctreeCell& cell) {
      if (marked.Mark(cell)) observation.free.push_back(cell);
    });
  };
  ForEachKnown(grid, camera, mark_occupied);  // first: marked cells are not marked again
  ForEachKnown(grid, camera, mark_free);
  return observation;
}

namespace {

// Along the normal, in cells: a surface that lies at a cell's border takes both cells beside it, as
// it is known to less than a cell, and what is behind is not passable.
constexpr std::array<double, 3> kSurfaceOffsets = {0, 0.25, -0.5};

// The cells of the patch that a point stands for, each once.
std::vector<OctreeCell> FindCells(const DensePoint& point, double spacing_m, double resolution_m) {
  // Less than a cell apart, from border to border of the patch.
  const int steps = static_cast<int>(std::ceil(spacing_m / (2 * resolution_m)));
  const Eigen::Vector3d across = 0.5 * spacing_m / steps * point.normal_world.unitOrthogonal();
  const Eigen::Vector3d up = point.normal_world.cross(across);
  std::vector<OctreeCell> cells;
  for (int i = -steps; i <= steps; ++i) {
    for (int j = -steps; j <= steps; ++j) {
      const Eigen::Vector3d p = (point.p_world + i * across + j * up) / resolution_m;
      for (const double offset : kSurfaceOffsets) {
        const OctreeCell cell = (p + offset * point.normal_world).array().floor().cast<int>();
        if (std::find(cells.begin(), cells.end(), cell) == cells.end()) cells.push_back(cell);
      }
    }
  }
  return cells;
}

}  // namespace

void MarkSurfaces(const std::vector<DensePoint>& points, double spacing_m, OccupancyMap* map) {
  for (const DensePoint& point : points) {
    map->Mark({{}, FindCells(point, spacing_m, map->resolution_m())});
  }
}

DepthOccupancy::DepthOccupancy(const OccupancyOptions& options)
    : carver_(options.resolution_m, options.max_range_m), map_(options.resolution_m) {}

void DepthOccupancy::Add(const RigidTransform& T_world_camera, const Camera& camera,
                         const DepthGrid& depth) {
  out_of_octree_ += map_.Update(carver_.Observe(T_world_camera, camera, depth));
}

OccupancyMap DepthOccupancy::Finish(const std::vector<DensePoint>& points, double spacing_m) {
  MarkSurfaces(points, spacing_m, &map_);
  map_.Finish();
  return std::move(map_);
}

namespace {

constexpr std::size_t kBatch = 8;      // views read at once
constexpr double kMaxTurn_rad = 0.45;  // of a neighbour's optical axis
constexpr double kMinOffset_m = 0.08;  // of a neighbour: nearer ones say little of depth
// Between a view and its neighbours: a fifth to a tenth of usual depths, so that some see what is
// near and some measure what is far.
constexpr std::array<double, 4> kWantedOffsets_m = {0.25, 0.5, 0.8, 0.4};

double OpticalAxesAngle(const RigidTransform& a, const RigidTransform& b) {
  const Eigen::Vector3d axis_a = a.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis_b = b.rotation * Eigen::Vector3d::UnitZ();
  return std::acos(std::clamp(axis_a.dot(axis_b), -1.0, 1.0));
}

}  // namespace

std::vector<std::size_t> SelectDenseViews(const Views& views, const DenseOptions& options) {
  std::vector<std::size_t> selected;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!selected.empty() && views[selected.back()].segment == views[i].segment &&
        views[selected.back()].left_camera == views[i].left_camera) {
      const RigidTransform& before = views[selected.back()].T_world_imu;
      const RigidTransform& now = views[i].T_world_imu;
      if ((now.translation - before.translation).norm() < options.min_travel_m &&
          now.rotation.angularDistance(before.rotation) < options.min_turn_rad) {
        continue;
      }
    }
    selected.push_back(i);
  }
  return selected;
}

DepthWindow::DepthWindow(const Views& views, const std::vector<std::size_t>& selected,
                         const ViewImages& images, const DenseOptions& options)
    : views_(views),
      selected_(selected),
      images_(images),
      options_(options),
      camera_(images.rig().cameras[0]) {}

std::vector<DepthWindow::ConfirmedView> DepthWindow::Next() {
  const std::size_t reach = kWindowViews, count = selected_.size();
  // How many of the selected views can be worked on when those before `known` are.
  const auto ready = [&](std::size_t known) {
    return known == count ? count : known - std::min(known, reach);
  };
  const std::size_t next_read = std::min(read_ + kBatch, count);
  window_.resize(next_read - first_);
  ParallelFor(read_, next_read, cv::getNumThreads(), [&](std::size_t i) { Read(i); });
  for (std::size_t i = read_; i < next_read; ++i) without_images_ += At(i).left.empty() ? 1 : 0;
  read_ = next_read;

  const std::size_t next_refined = ready(read_);
  ParallelFor(refined_, next_refined, cv::getNumThreads(), [&](std::size_t i) { Refine(i); });
  refined_ = next_refined;

  const std::size_t begin = confirmed_;
  std::vector<ConfirmedView> done(ready(refined_) - begin);
  ParallelFor(begin, begin + done.size(), cv::getNumThreads(), [&](std::size_t i) {
    done[i - begin] = {selected_[i], Confirm(i)};
  });
  confirmed_ += done.size();
  for (; first_ + reach < confirmed_; ++first_) window_.pop_front();
  return done;
}

void DepthWindow::Read(std::size_t i) {
  WindowView& view = At(i);
  const View& source = views_[selected_[i]];
  view.T_world_camera = WorldFromCamera(source, images_.rig());
  view.segment = source.segment;
  const StereoImage pair = images_.Read(selected_[i]);
  view.depth = StereoDepth(pair, images_.mask_of(selected_[i], 0), images_.rig(), options_,
                           source.left_camera);
  if (pair.left.empty() || pair.right.empty()) return;
  view.left = DepthPyramid(pair.left);
  view.right = DepthPyramid(pair.right);
}

std::vector<std::size_t> DepthWindow::Around(std::size_t i) const {
  const std::size_t reach = kWindowViews;
  std::vector<std::size_t> around;
  for (std::size_t j = i - std::min(i, reach); j <= i + reach && j < read_; ++j) {
    if (j != i && At(j).segment == At(i).segment && !At(j).left.empty()) around.push_back(j);
  }
  return around;
}

std::vector<std::size_t> DepthWindow::FindNeighbours(std::size_t i) const {
  std::vector<std::size_t> candidates;
  const auto offset_m = [&](std::size_t j) {
    return (At(j).T_world_camera.translation - At(i).T_world_camera.translation).norm();
  };
  for (const std::size_t j : Around(i)) {
    if (offset_m(j) >= kMinOffset_m &&
        OpticalAxesAngle(At(i).T_world_camera, At(j).T_world_camera) <= kMaxTurn_rad) {
      candidates.push_back(j);
    }
  }
  std::vector<std::size_t> neighbours;
  for (int k = 0; k < kNeighbours && !candidates.empty(); ++k) {
    const double wanted_m = kWantedOffsets_m[k % kWantedOffsets_m.size()];
    const auto nearest =
        std::min_element(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
          return std::abs(std::log(offset_m(a) / wanted_m)) <
                 std::abs(std::log(offset_m(b) / wanted_m));
        });
    neighbours.push_back(*nearest);
    candidates.erase(nearest);
  }
  return neighbours;
}

void DepthWindow::Refine(std::size_t i) {
  WindowView& view = At(i);
  if (view.left.empty()) return;
  const int left_camera = views_[selected_[i]].left_camera;
  std::vector<NeighbourImage> neighbours = {
      {&view.right, RightFromLeft(images_.rig(), left_camera), options_.pair_sigma_px}};
  for (const std::size_t j : FindNeighbours(i)) {
    neighbours.push_back(
        {&At(j).left, At(j).T_world_camera.Inverse() * view.T_world_camera, kPoseSigma_px});
  }
  RefineDepth(view.left, neighbours, camera_, &view.depth);
  view.right = DepthPyramid();
}

DepthGrid DepthWindow::Confirm(std::size_t i) const {
  std::vector<PlacedGrid> others;
  for (const std::size_t j : Around(i)) others.push_back({At(j).T_world_camera, &At(j).depth});
  return ConfirmedDepth({At(i).T_world_camera, &At(i).depth}, others, camera_, options_);
}

DenseMap BuildDense(const Views& views, const ViewImages& images, const DenseOptions& options,
                    const Progress& progress, const DepthSink& sink) {
  options.Check();
  const std::vector<std::size_t> selected = SelectDenseViews(views, options);
  const Rig& rig = images.rig();
  DepthWindow window(views, selected, images, options);
  DepthFusion fusion(options);
  const auto fuse = [&](const std::vector<DepthWindow::ConfirmedView>& confirmed) {
    for (const auto& [view, depth] : confirmed) {
      fusion.Add(WorldFromCamera(views[view], rig), rig.cameras[0], depth);
      if (sink) sink(view, depth);
    }
  };
  // Views are fused in their order, on a thread of their own while the next are read and matched.
  const auto policy = cv::getNumThreads() > 1 ? std::launch::async : std::launch::deferred;
  std::future<void> fused;
  while (!window.is_done()) {
    const double share = static_cast<double>(window.read()) / static_cast<double>(selected.size());
    if (!progress.Report(share)) break;
    std::vector<DepthWindow::ConfirmedView> confirmed = window.Next();
    if (fused.valid()) fused.get();
    fused = std::async(policy, fuse, std::move(confirmed));
  }
  if (fused.valid()) fused.get();
  DenseMap map;
  map.points = fusion.Points();
  map.views = static_cast<int64_t>(window.read());
  map.views_without_images = window.without_images();
  return map;
}

namespace {

// Every other node is enough for openings, which are some 40 cm wide.
ViewRays CollectViewRays(const RigidTransform& T_world_camera, const Camera& camera,
                         const DepthGrid& depth) {
  constexpr int kStep = 2;
  ViewRays rays;
  rays.p_world_camera = T_world_camera.translation;
  for (int row = 0; row < depth.rows; row += kStep) {
    for (int column = 0; column < depth.columns; column += kStep) {
      const DepthNode& node = depth.At(column, row);
      if (!node.is_known()) continue;
      const Eigen::Vector3d ray =
          PinholeRay(camera, depth.ColumnPixel(column), depth.RowPixel(row));
      rays.p_world.push_back((T_world_camera * (node.depth_m() * ray)).cast<float>());
      rays.sigma_m.push_back(static_cast<float>(node.depth_sigma_m() * ray.norm()));
    }
  }
  return rays;
}

}  // namespace

std::vector<ViewRays> MapDensely(const Views& views, const ViewImages& images,
                                 const DenseOptions& options,
                                 const OccupancyOptions& occupancy_options,
                                 const Progress& progress, MapResult* map) {
  DepthOccupancy occupancy(occupancy_options);
  const Rig& rig = images.rig();
  std::vector<ViewRays> rays;
  DenseMap dense =
      BuildDense(views, images, options, progress, [&](std::size_t view, const DepthGrid& depth) {
        const RigidTransform T_world_camera = WorldFromCamera(views[view], rig);
        occupancy.Add(T_world_camera, rig.cameras[0], depth);
        rays.push_back(CollectViewRays(T_world_camera, rig.cameras[0], depth));
      });
  map->dense = std::move(dense.points);
  map->occupancy = occupancy.Finish(map->dense, options.voxel_m);
  if (dense.views_without_images > 0) {
    map->warnings["dense_views_without_images"] += dense.views_without_images;
  }
  if (occupancy.out_of_octree() > 0) map->warnings[kRayOutOfOctree] += occupancy.out_of_octree();
  return rays;
}

}  // namespace slcmap::mapping
