#include "mapping/junctions/plane_junction.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "data/quantile.h"

namespace slcmap {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kFacing = 0.8;     // least cosine between a point's normal and its plane's
constexpr double kMaxCosine = 0.5;  // between the normals of planes that meet

double DistanceTo(const BuildingPlane& plane, const Vector3d& p) {
  return plane.normal.dot(p) - plane.offset_m;
}

AlignedBox3d Grown(AlignedBox3d box, double by_m) {
  if (box.isEmpty()) return box;
  box.min().array() -= by_m;
  box.max().array() += by_m;
  return box;
}

// The points of a surface around one bin of a junction.
struct Bin {
  int points = 0;  // within reach of the junction
  double gap_m =
      std::numeric_limits<double>::infinity();  // from the junction to the nearest of them
  std::vector<double> offsets_m;  // of those that are beyond the corner, from the plane
};

// The points of `surface` in front of `other`, by the bin along the junction.
std::map<int, Bin> BinsOf(const SurfacePoints& surface, const BuildingPlane& other,
                          const Vector3d& direction, const JunctionOptions& options) {
  std::map<int, Bin> bins;
  for (const Vector3d& p : surface.points_world) {
    const double from_junction_m = DistanceTo(other, p);
    if (from_junction_m < 0 || from_junction_m > options.offset_reach_m) continue;
    Bin& bin = bins[static_cast<int>(std::floor(direction.dot(p) / options.bin_m))];
    if (from_junction_m <= options.reach_m) {
      ++bin.points;
      bin.gap_m = std::min(bin.gap_m, from_junction_m);
    }
    if (from_junction_m >= options.corner_m) {
      bin.offsets_m.push_back(DistanceTo(*surface.plane, p));
    }
  }
  return bins;
}

// Up to a number of bins to either side of one.
template <typename Take>
void ForBinsAround(const std::map<int, Bin>& bins, int index, double around_m, double bin_m,
                   Take take) {
  const int around = static_cast<int>(std::lround(around_m / bin_m));
  for (auto bin = bins.lower_bound(index - around);
       bin != bins.end() && bin->first <= index + around; ++bin) {
    take(bin->second);
  }
}

// The points of a surface that is measured near a bin; 0 where it is not.
int PointsAt(const std::map<int, Bin>& bins, int index, const JunctionOptions& options) {
  int points = 0;
  double gap_m = std::numeric_limits<double>::infinity();
  ForBinsAround(bins, index, options.window_m, options.bin_m, [&](const Bin& bin) {
    points += bin.points;
    gap_m = std::min(gap_m, bin.gap_m);
  });
  return points >= options.min_points && gap_m <= options.max_gap_m ? points : 0;
}

// How far a surface is off its plane around a bin.
double OffsetAt_m(const std::map<int, Bin>& bins, int index, const JunctionOptions& options) {
  std::vector<double> offsets_m;
  ForBinsAround(bins, index, options.offset_reach_m, options.bin_m, [&](const Bin& bin) {
    offsets_m.insert(offsets_m.end(), bin.offsets_m.begin(), bin.offsets_m.end());
  });
  return offsets_m.empty() ? 0 : Quantile(std::move(offsets_m), 0.5);
}

bool IsBetweenCorners(const PlaneOpening& opening, const Vector3d& axis, const Vector3d& p,
                      double before_m = 0) {
  double from_m = std::numeric_limits<double>::infinity(), to_m = -from_m;
  for (const Vector3d& corner : opening.outline_world) {
    from_m = std::min(from_m, axis.dot(corner));
    to_m = std::max(to_m, axis.dot(corner));
  }
  return axis.dot(p) >= from_m - before_m && axis.dot(p) <= to_m;
}

// In a doorway a wall meets no floor, but what is measured beside it is near enough. Its sill may
// be somewhat above the floor; at its sides and above it there is wall.
bool IsInOpening(const BuildingPlane& plane, const Vector3d& direction, const Vector3d& p) {
  constexpr double kSill_m = 0.1, kUpright = 0.5;
  Vector3d across = plane.normal.cross(direction);
  if (across.z() < 0) across = -across;
  const double below_m = across.z() > kUpright ? kSill_m : 0;
  return std::any_of(plane.openings.begin(), plane.openings.end(), [&](const PlaneOpening& o) {
    return IsBetweenCorners(o, direction, p) && IsBetweenCorners(o, across, p, below_m);
  });
}

bool MayMeet(const SurfacePoints& a, const SurfacePoints& b, const JunctionOptions& options) {
  return std::abs(a.plane->normal.dot(b.plane->normal)) <= kMaxCosine &&
         Grown(a.box, options.reach_m).intersects(b.box);
}

}  // namespace

std::vector<SurfacePoints> PointsOfPlanes(const Building& building,
                                          const std::vector<DensePoint>& cloud,
                                          const JunctionOptions& options) {
  std::vector<SurfacePoints> surfaces;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind == PlaneKind::kOther) continue;
    SurfacePoints surface{&plane, {}, {}};
    AlignedBox3d box;
    for (const Vector3d& corner : plane.outline_world) box.extend(corner);
    box = Grown(box, options.reach_m);
    for (const DensePoint& point : cloud) {
      if (!box.contains(point.p_world) ||
          std::abs(DistanceTo(plane, point.p_world)) > options.beside_m ||
          plane.normal.dot(point.normal_world) < kFacing) {
        continue;
      }
      surface.points_world.push_back(point.p_world);
      surface.box.extend(point.p_world);
    }
    surfaces.push_back(std::move(surface));
  }
  return surfaces;
}

Vector3d PlaneJunction::At(double along_m, const Eigen::Vector2d& offset_m) const {
  Eigen::Matrix3d rows;
  rows << planes[0]->normal.transpose(), planes[1]->normal.transpose(), direction_world.transpose();
  return rows.inverse() *
         Vector3d(planes[0]->offset_m + offset_m[0], planes[1]->offset_m + offset_m[1], along_m);
}

std::optional<PlaneJunction> FindJunction(const SurfacePoints& first, const SurfacePoints& second,
                                          const JunctionOptions& options) {
  if (!MayMeet(first, second, options)) return std::nullopt;
  PlaneJunction junction;
  junction.planes[0] = first.plane;
  junction.planes[1] = second.plane;
  junction.direction_world = first.plane->normal.cross(second.plane->normal).normalized();
  const auto bins = BinsOf(first, *second.plane, junction.direction_world, options);
  const auto others = BinsOf(second, *first.plane, junction.direction_world, options);
  if (bins.empty() || others.empty()) return std::nullopt;
  const int begin = std::max(bins.begin()->first, others.begin()->first);
  const int end = std::min(bins.rbegin()->first, others.rbegin()->first);
  for (int i = begin; i <= end; ++i) {
    const int points = PointsAt(bins, i, options), of_other = PointsAt(others, i, options);
    if (points == 0 || of_other == 0) continue;
    const double along_m = (i + 0.5) * options.bin_m;
    const Vector3d on_planes = junction.At(along_m, Eigen::Vector2d::Zero());
    if (IsInOpening(*first.plane, junction.direction_world, on_planes) ||
        IsInOpening(*second.plane, junction.direction_world, on_planes)) {
      continue;
    }
    junction.places.push_back(
        {along_m, {OffsetAt_m(bins, i, options), OffsetAt_m(others, i, options)}});
    junction.points += points + of_other;
  }
  if (junction.places.empty()) return std::nullopt;
  return junction;
}

}  // namespace slcmap
