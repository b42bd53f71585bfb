#include "mapping/planes/plane_filling.h"

#include <algorithm>
#include <cmath>

#include "mapping/dense/parallel.h"
#include "mapping/planes/patch_sweeper.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kIndex_m = 0.05;       // edges of the cubes that measured points are looked up in
constexpr double kSamePlace_m = 0.025;  // of points of two planes that are one, and off each
constexpr double kOneSurface_m = 0.1;   // filled planes that are nearer to each other are one
constexpr double kBehind_m = 0.03;      // a plane, as what it hides

std::vector<AskedPlane> AskPlanes(const MeasuredBuilding& measured, const PlaneOptions& options,
                                  int threads) {
  std::vector<SuggestedPlane> suggested =
      SuggestPlanes(measured.dense, measured.lines, measured.voxel_m, options);
  std::erase_if(suggested, [&](const SuggestedPlane& plane) {
    return plane.weight * measured.voxel_m * measured.voxel_m < options.min_support_m2;
  });
  std::stable_sort(suggested.begin(), suggested.end(),
                   [](const auto& a, const auto& b) { return a.weight > b.weight; });
  PointIndex index(kIndex_m);
  for (size_t i = 0; i < measured.dense.size(); ++i) index.Add(measured.dense[i].p_world, i);
  std::vector<AskedPlane> planes(suggested.size());
  ParallelFor(0, planes.size(), threads, [&](size_t i) {
    planes[i] = AskPlane(std::move(suggested[i]), index, measured.sights, options);
  });
  return planes;
}

// Whether a plane lies on the way from a camera to a place.
bool IsBetween(const AskedPlane& plane, const Vector3d& camera, const Vector3d& place) {
  const PlaneGrid& grid = plane.suggested.grid;
  const double before_m = grid.DistanceTo(camera), after_m = grid.DistanceTo(place);
  if (before_m <= 0 || after_m >= -kBehind_m) return false;
  const Vector3d at = camera + before_m / (before_m - after_m) * (place - camera);
  const int column = grid.ColumnOf(at), row = grid.RowOf(at);
  return grid.Contains(column, row) && plane.solid(row, column) != 0;
}

// The cells of a patch; but those that other planes would hide.
void FillPatch(const std::vector<AskedPlane>& planes, const AskedPlane& plane,
               const AskedPatch& asked, const Vector3d& camera, int side,
               std::vector<DensePoint>* points) {
  const PlaneGrid& grid = plane.suggested.grid;
  for (int row = asked.row * side; row < (asked.row + 1) * side; ++row) {
    for (int column = asked.column * side; column < (asked.column + 1) * side; ++column) {
      const Vector3d p = grid.At(column + 0.5, row + 0.5);
      if (!plane.open(row, column) ||
          std::any_of(planes.begin(), planes.end(),
                      [&](const AskedPlane& other) { return IsBetween(other, camera, p); })) {
        continue;
      }
      points->push_back({p, grid.normal, plane.suggested.sigma_m,
                         static_cast<uint8_t>(std::lround(std::min(asked.sweep.grey, 255.0))),
                         DenseSource::kFilledPlane});
    }
  }
}

// Of planes that were suggested twice, or lie close to each other, the first.
std::vector<DensePoint> FirstOfEach(const std::vector<DensePoint>& filled) {
  PointIndex taken(kOneSurface_m);
  std::vector<DensePoint> points;
  for (const DensePoint& point : filled) {
    const bool is_taken = taken.AnyNear(point.p_world, kOneSurface_m, [&](size_t i) {
      const Vector3d way = point.p_world - points[i].p_world;
      const double off_m = std::abs(way.dot(points[i].normal_world));
      return points[i].normal_world.dot(point.normal_world) > 0.7 &&
             (way.norm() < kSamePlace_m || off_m > kSamePlace_m);
    });
    if (is_taken) continue;
    taken.Add(point.p_world, points.size());
    points.push_back(point);
  }
  return points;
}

}  // namespace

std::vector<DensePoint> FillPlanes(const Views& views, const ViewImages& images,
                                   const MeasuredBuilding& measured, const PlaneOptions& options,
                                   int threads, const Progress& progress) {
  options.Check();
  if (!progress.Report(0)) return {};
  std::vector<AskedPlane> planes = AskPlanes(measured, options, threads);
  PatchSweeper sweeper(views, images, measured.depths, options, threads);
  if (!sweeper.Sweep(&planes, progress)) return {};
  for (AskedPlane& plane : planes) JudgePatches(options, &plane);
  const ViewCameras cameras(views, images.rig());
  std::vector<DensePoint> filled;
  for (const AskedPlane& plane : planes) {
    for (const AskedPatch& asked : plane.patches) {
      if (!asked.agrees) continue;
      const PatchImage& image = asked.images.front();
      FillPatch(planes, plane, asked, cameras.Centre(image.view, image.camera),
                CellsOfPatch(options), &filled);
    }
  }
  return FirstOfEach(filled);
}

}  // namespace slcmap
