#include "mapping/planes/plane_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mapping/planes/bounded_plane.h"
#include "mapping/point_index.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kFacingCosine = 0.7;  // cosine between normals
constexpr double kMoved_m = 0.02;      // less, and a point is where stereo had it
constexpr double kMerged_m = 0.03;     // of points that are one

// A plane that a point lies on, and how far it is from it.
struct Drawn {
  const BoundedPlane* plane = nullptr;
  double distance_m = 0, surface_sigma_m = 0;
};

Drawn NearestPlane(const std::vector<BoundedPlane>& planes, const DensePoint& point,
                   const PlaneOptions& options) {
  Drawn nearest;
  double least_sigmas = options.draw_sigmas;
  for (const BoundedPlane& plane : planes) {
    const PlaneGrid& grid = plane.grid;
    if (!plane.is_measured || grid.normal.dot(point.normal_world) < kFacingCosine) continue;
    const double distance_m = grid.DistanceTo(point.p_world);
    const double surface_sigma_m = std::hypot(plane.sigma_m, options.surface_sigma_m);
    const double sigmas = std::abs(distance_m) / std::hypot(surface_sigma_m, point.sigma_m);
    if (sigmas > least_sigmas) continue;
    const int column = grid.ColumnOf(point.p_world), row = grid.RowOf(point.p_world);
    if (!grid.Contains(column, row) || !plane.inside(row, column)) continue;
    least_sigmas = sigmas;
    nearest = {&plane, distance_m, surface_sigma_m};
  }
  return nearest;
}

// How far it has moved.
double Draw(const Drawn& to, DensePoint* point) {
  const double plane = to.surface_sigma_m * to.surface_sigma_m;
  const double stereo = point->sigma_m * point->sigma_m;
  const double move_m = to.distance_m * stereo / (plane + stereo);
  point->p_world -= move_m * to.plane->grid.normal;
  point->sigma_m = std::sqrt(plane * stereo / (plane + stereo));
  return std::abs(move_m);
}

// Those that have moved, and are where a better known one is now.
std::vector<bool> OnBetterOnes(const std::vector<DensePoint>& dense,
                               const std::vector<double>& moved_m) {
  std::vector<size_t> order(dense.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order,
                           [&](size_t a, size_t b) { return dense[a].sigma_m < dense[b].sigma_m; });
  PointIndex taken(kMerged_m);
  std::vector<bool> gone(dense.size());
  for (const size_t i : order) {
    const Vector3d& p = dense[i].p_world;
    const auto faces_alike = [&](size_t k) {
      return dense[k].normal_world.dot(dense[i].normal_world) > 0;  // else another side of it
    };
    gone[i] = moved_m[i] > kMoved_m && taken.AnyNear(p, kMerged_m, faces_alike);
    if (!gone[i]) taken.Add(p, i);
  }
  return gone;
}

}  // namespace

void DrawToPlanes(const Building& building, const PlaneOptions& options,
                  std::vector<DensePoint>* dense) {
  if (!(options.draw_sigmas > 0)) return;
  const std::vector<BoundedPlane> planes = BoundedPlanes(building, options);
  std::vector<double> moved_m(dense->size());
  for (size_t i = 0; i < dense->size(); ++i) {
    const Drawn to = NearestPlane(planes, (*dense)[i], options);
    if (to.plane) moved_m[i] = Draw(to, &(*dense)[i]);
  }
  const std::vector<bool> gone = OnBetterOnes(*dense, moved_m);
  size_t kept = 0;
  for (size_t i = 0; i < dense->size(); ++i) {
    if (!gone[i]) (*dense)[kept++] = (*dense)[i];
  }
  dense->resize(kept);
}

}  // namespace slcmap
