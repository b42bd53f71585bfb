#include "mapping/junctions/plane_junction.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

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
  int points = 0;                 // within reach of the junction
  double gap_m = 1e9;             // from the junction to the nearest of them
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

struct SurfaceAtBin {
  int points = 0;
  double gap_m = 1e9;
  double offset_m = 0;
};

SurfaceAtBin AtBin(const std::map<int, Bin>& bins, int index, const JunctionOptions& options) {
  const int window = static_cast<int>(std::lround(options.window_m / options.bin_m));
  const int around = static_cast<int>(std::lround(options.offset_reach_m / options.bin_m));
  SurfaceAtBin surface;
  std::vector<double> offsets_m;
  for (auto bin = bins.lower_bound(index - std::max(window, around));
       bin != bins.end() && bin->first <= index + std::max(window, around); ++bin) {
    if (std::abs(bin->first - index) <= window) {
      surface.points += bin->second.points;
      surface.gap_m = std::min(surface.gap_m, bin->second.gap_m);
    }
    if (std::abs(bin->first - index) <= around) {
      offsets_m.insert(offsets_m.end(), bin->second.offsets_m.begin(), bin->second.offsets_m.end());
    }
  }
  if (offsets_m.empty()) return surface;
  const auto middle = offsets_m.begin() + static_cast<ptrdiff_t>(offsets_m.size() / 2);
  std::nth_element(offsets_m.begin(), middle, offsets_m.end());
  surface.offset_m = *middle;
  return surface;
}

bool IsMeasured(const SurfaceAtBin& surface, const JunctionOptions& options) {
  return surface.points >= options.min_points && surface.gap_m <= options.max_gap_m;
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
    const SurfaceAtBin a = AtBin(bins, i, options), b = AtBin(others, i, options);
    if (!IsMeasured(a, options) || !IsMeasured(b, options)) continue;
    junction.places.push_back({(i + 0.5) * options.bin_m, {a.offset_m, b.offset_m}});
    junction.points += a.points + b.points;
  }
  if (junction.places.empty()) return std::nullopt;
  return junction;
}

}  // namespace slcmap
