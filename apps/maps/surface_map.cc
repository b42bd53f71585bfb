#include "apps/maps/surface_map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "apps/evaluation/straightness.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Faces of a thin wall are apart in the smallest; larger ones are for sparse and noisy clouds.
constexpr double kCubes_m[] = {0.05, 0.1, 0.2, 0.4};
constexpr double kMostlyPlanes = 0.5;  // of the cubes, for a size to do
constexpr double kPlaneFlatness = 0.2;
constexpr double kLayer_m = 0.06;  // of a wall: the other face of a thin one is further
constexpr int kPlanePoints = 8;    // that a plane is fitted to
// Of the points of a cube of 20 cm about so many are kept, one a square centimetre of a wall.
constexpr double kThinned_m = 0.2;
constexpr uint64_t kMostThinned = 400;
// Around a place within a surface nearly all goes along it: at corners planes are of two.
constexpr double kWithin_m = 0.15, kAlongCosine = 0.94, kMostlyAlong = 0.95;
constexpr size_t kMostDirections = 1500;
constexpr double kZIsUp_deg = 20;
constexpr double kFloors = 0.1;  // of all normals, for floors to tell what is upwards
constexpr double kMeshSample_m = 0.02;
constexpr size_t kMostMeshSamples = 4000000;

// Sums over points about a place near them.
struct CubeSums {
  double count = 0;
  Vector3d sum = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();
};

// A whole number of metres near the first point, so that a map is the same in UTM, and a bit of no
// round number: rounding would tell on which side of a border of cubes walls at these are.
Vector3d FindOrigin(const std::vector<Vector3d>& points) {
  const Vector3d beside(0.01837, 0.02243, 0.01579);
  if (points.empty()) return beside;
  return (points.front() + beside).array().round().matrix() + beside;
}

double AxisAngle_deg(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(1.0, std::abs(a.dot(b)))) * kDegreesPerRadian;
}

}  // namespace

uint64_t MixBits(uint64_t value) {
  value += 0x9e3779b97f4a7c15ull;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ull;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebull;
  return value ^ (value >> 31);
}

SurfaceMap::SurfaceMap(std::vector<Vector3d> points) : origin_(FindOrigin(points)) {
  points = Thin(std::move(points));
  for (const double cube_m : kCubes_m) {
    Fill(points, cube_m);
    FitPlanes();
    if (planes_ >= kMostlyPlanes * static_cast<double>(cubes_.size())) break;
  }
}

// Each point of a crowded place is as likely to stay as any other.
std::vector<Vector3d> SurfaceMap::Thin(std::vector<Vector3d> points) const {
  std::unordered_map<int64_t, uint64_t> counts;
  const auto key = [&](const Vector3d& p) { return MakeKey(Locate(p, kThinned_m)); };
  for (const Vector3d& p : points) ++counts[key(p)];
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const uint64_t count = counts[key(points[i])];
    if (count <= kMostThinned || MixBits(i) % count < kMostThinned) points[kept++] = points[i];
  }
  points.resize(kept);
  return points;
}

Eigen::Vector3i SurfaceMap::Locate(const Vector3d& p, double cube_m) const {
  return FindCube(p - origin_, cube_m);
}

int SurfaceMap::FindAt(const Eigen::Vector3i& place) const {
  const auto found = index_.find(MakeKey(place));
  return found == index_.end() ? -1 : found->second;
}

void SurfaceMap::Fill(const std::vector<Vector3d>& points, double cube_m) {
  cube_m_ = cube_m;
  points_.clear(), cubes_.clear(), where_.clear(), index_.clear();
  for (const Vector3d& p : points) {
    const Eigen::Vector3i place = Locate(p, cube_m);
    const auto [entry, is_new] = index_.try_emplace(MakeKey(place), cubes_.size());
    if (is_new) {
      cubes_.emplace_back();
      where_.push_back(place);
    }
    cubes_[static_cast<size_t>(entry->second)].points.push_back(
        static_cast<int32_t>(points_.size()));
    points_.push_back(p);
  }
}

void SurfaceMap::FitPlanes() {
  std::vector<CubeSums> sums(cubes_.size());
  const auto middle = [&](size_t i) -> Vector3d {
    return origin_ + cube_m_ * (where_[i].cast<double>() + Vector3d::Constant(0.5));
  };
  for (size_t i = 0; i < cubes_.size(); ++i) {
    for (const int32_t point : cubes_[i].points) {
      const Vector3d offset = points_[static_cast<size_t>(point)] - middle(i);
      sums[i].count += 1;
      sums[i].sum += offset;
      sums[i].products += offset * offset.transpose();
    }
  }
  planes_ = 0;
  for (size_t i = 0; i < cubes_.size(); ++i) {
    CubeSums all = sums[i];
    ForEachAround(i, [&](size_t other) {
      const Vector3d shift = middle(other) - middle(i);
      const CubeSums& s = sums[other];
      all.count += s.count;
      all.sum += s.sum + s.count * shift;
      all.products += s.products + s.sum * shift.transpose() + shift * s.sum.transpose() +
                      s.count * shift * shift.transpose();
    });
    SurfaceCube& cube = cubes_[i];
    const Vector3d mean = all.sum / all.count;
    cube.p = middle(i) + mean;
    if (all.count < kPlanePoints) continue;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(all.products / all.count -
                                                         mean * mean.transpose());
    cube.normal = solver.eigenvectors().col(0);
    RefitPlane(i);
    planes_ += cube.is_plane;
  }
}

void SurfaceMap::RefitPlane(size_t i) {
  SurfaceCube& cube = cubes_[i];
  std::vector<double> own_m;
  for (const int32_t point : cube.points) {
    own_m.push_back(cube.normal.dot(points_[static_cast<size_t>(point)]));
  }
  const double layer_m = Quantile(own_m, 0.5);
  const Vector3d origin = cube.p;
  CubeSums layer;
  const auto add = [&](size_t other) {
    for (const int32_t point : cubes_[other].points) {
      const Vector3d& p = points_[static_cast<size_t>(point)];
      if (std::abs(cube.normal.dot(p) - layer_m) > kLayer_m) continue;
      layer.count += 1;
      layer.sum += p - origin;
      layer.products += (p - origin) * (p - origin).transpose();
    }
  };
  add(i);
  ForEachAround(i, add);
  if (layer.count < kPlanePoints) return;
  const Vector3d mean = layer.sum / layer.count;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(layer.products / layer.count -
                                                       mean * mean.transpose());
  cube.p = origin + mean;
  cube.normal = solver.eigenvectors().col(0);
  cube.flatness = solver.eigenvalues()[0] / std::max(1e-12, solver.eigenvalues()[1]);
  cube.is_plane = cube.flatness < kPlaneFlatness;
}

std::vector<size_t> SurfaceMap::SomePlanes(size_t most) const {
  std::vector<size_t> some;
  for (size_t i = 0; i < cubes_.size(); ++i) {
    if (cubes_[i].is_plane) some.push_back(i);
  }
  std::sort(some.begin(), some.end(), [&](size_t a, size_t b) {
    return MixBits(static_cast<uint64_t>(MakeKey(where_[a]))) <
           MixBits(static_cast<uint64_t>(MakeKey(where_[b])));
  });
  std::vector<size_t> kept;
  for (const size_t i : some) {
    if (kept.size() == most) break;
    if (IsWithinSurface(i)) kept.push_back(i);
  }
  return kept;
}

bool SurfaceMap::IsWithinSurface(size_t i) const {
  const int reach = static_cast<int>(std::ceil(kWithin_m / cube_m_));
  size_t all = 0, along = 0;
  for (int x = -reach; x <= reach; ++x) {
    for (int y = -reach; y <= reach; ++y) {
      for (int z = -reach; z <= reach; ++z) {
        const int found = FindAt(where_[i] + Eigen::Vector3i(x, y, z));
        if (found < 0) continue;
        const SurfaceCube& cube = cubes_[static_cast<size_t>(found)];
        all += cube.points.size();
        if (std::abs(cube.normal.dot(cubes_[i].normal)) > kAlongCosine) along += cube.points.size();
      }
    }
  }
  return static_cast<double>(along) >= kMostlyAlong * static_cast<double>(all);
}

NearPlanes::NearPlanes(const SurfaceMap& map) : map_(map) {
  std::vector<Eigen::Vector3f> places;
  for (size_t i = 0; i < map.cubes().size(); ++i) {
    if (!map.cubes()[i].is_plane) continue;
    if (cubes_.empty()) origin_ = map.cubes()[i].p;
    cubes_.push_back(i);
    places.push_back((map.cubes()[i].p - origin_).cast<float>());
  }
  planes_ = std::make_unique<PointTree>(places);
  places.clear();
  for (const Vector3d& p : map.points()) places.push_back((p - origin_).cast<float>());
  points_ = std::make_unique<PointTree>(places);
}

std::optional<NearPlanes::Match> NearPlanes::Find(const Vector3d& p, double reach_m,
                                                  const Vector3d* normal) const {
  constexpr int kLookedAtPlanes = 6;
  std::optional<Match> nearest;
  if (cubes_.empty()) return nearest;
  PointTree::Found found;
  planes_->FindNearest((p - origin_).cast<float>(), kLookedAtPlanes, &found);
  double nearest_m = HUGE_VAL;
  for (const int item : found.items) {
    const size_t index = cubes_[static_cast<size_t>(item)];
    const SurfaceCube& cube = map_.cubes()[index];
    if (normal && std::abs(cube.normal.dot(*normal)) < 0.9) continue;
    const Vector3d from = p - cube.p;
    const double off_m = cube.normal.dot(from);
    // Beyond the plane's own cube it counts how far that is.
    const double beside_m =
        std::max(0.0, (from - off_m * cube.normal).norm() - 1.5 * map_.cube_m());
    const double distance_m = std::hypot(off_m, beside_m);
    if (distance_m > reach_m || distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    nearest = Match{index, off_m};
  }
  return nearest;
}

std::optional<double> NearPlanes::FindOff_m(const Vector3d& p, double reach_m) const {
  PointTree::Found found;
  points_->FindNearest((p - origin_).cast<float>(), 1, &found);
  double off_m = HUGE_VAL;
  for (const int item : found.items) {
    off_m = (p - map_.points()[static_cast<size_t>(item)]).norm();
  }
  if (const auto plane = Find(p, reach_m)) off_m = std::min(off_m, std::abs(plane->off_m));
  return off_m <= reach_m ? std::optional(off_m) : std::nullopt;
}

Vector3d FindExtents(const std::vector<Vector3d>& places) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : places) mean += p / static_cast<double>(places.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& p : places) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(spread);
  Vector3d extents;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& p : places) values.push_back(solver.eigenvectors().col(axis).dot(p));
    extents[axis] = Quantile(values, 0.98) - Quantile(values, 0.02);
  }
  std::sort(extents.data(), extents.data() + 3);
  return extents;
}

BuildingAxes FindAxes(const std::vector<Vector3d>& directions,
                      const std::vector<Vector3d>& places) {
  std::vector<WeightedDirection> some;
  const size_t step = directions.size() / kMostDirections + 1;
  for (size_t i = 0; i < directions.size(); i += step) some.push_back({directions[i], 1});
  BuildingAxes found;
  const auto measured = some.empty() ? std::nullopt : MeasureDirections(some, 10, 0);
  if (!measured) return found;
  found.are_found = true;
  Matrix3d axes = measured->axes;
  int up = 0;
  double least_m = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vector3d& p : places) along.push_back(axes.col(axis).dot(p));
    const double extent_m = Quantile(along, 0.98) - Quantile(along, 0.02);
    if (extent_m < least_m) least_m = extent_m, up = axis;
  }
  found.is_z_up = false;
  for (int axis = 0; axis < 3; ++axis) {
    const double angle_deg = AxisAngle_deg(axes.col(axis), Vector3d::UnitZ());
    if (angle_deg > kZIsUp_deg) continue;
    up = axis;
    found.is_z_up = true;
    found.tilt_deg = angle_deg;
  }
  const Vector3d upwards = (found.is_z_up && axes(2, up) < 0 ? -1 : 1) * axes.col(up);
  const Vector3d level = axes.col((up + 1) % 3);
  found.axes.col(0) = level;
  found.axes.col(1) = upwards.cross(level);
  found.axes.col(2) = upwards;
  return found;
}

BuildingAxes WithUp(BuildingAxes axes, const Vector3d& upwards) {
  const Vector3d own = axes.axes.col(0), level = (own - upwards.dot(own) * upwards).normalized();
  axes.axes << level, upwards.cross(level), upwards;
  if (axes.is_z_up) axes.tilt_deg = AxisAngle_deg(upwards, Vector3d::UnitZ());
  return axes;
}

Vector3d FindUpOfFloors(const BuildingAxes& axes, const std::vector<Vector3d>& normals) {
  Vector3d upwards = axes.axes.col(2);
  for (const double within_deg : {10.0, 3.0}) {
    Vector3d sum = Vector3d::Zero();
    double floors = 0;
    for (const Vector3d& normal : normals) {
      if (AxisAngle_deg(normal, upwards) > within_deg) continue;
      sum += normal.dot(upwards) < 0 ? Vector3d(-normal) : normal;
      ++floors;
    }
    if (floors < kFloors * static_cast<double>(normals.size())) return axes.axes.col(2);
    upwards = sum.normalized();
  }
  return upwards;
}

std::vector<Vector3d> SurfacePoints(const ExternalMap& map) {
  std::vector<Vector3d> points = map.points;
  std::vector<double> areas_m2{0};  // up to each triangle
  for (const auto& [a, b, c] : map.triangles) {
    areas_m2.push_back(areas_m2.back() + 0.5 * (b - a).cross(c - a).norm());
  }
  const double samples = areas_m2.back() / (kMeshSample_m * kMeshSample_m);
  const auto count = static_cast<size_t>(std::min(samples, static_cast<double>(kMostMeshSamples)));
  size_t triangle = 0;
  for (size_t i = 0; i < count; ++i) {
    const double at_m2 =
        (static_cast<double>(i) + 0.5) / static_cast<double>(count) * areas_m2.back();
    while (areas_m2[triangle + 1] < at_m2) ++triangle;
    // Two numbers that fill a square evenly; beyond its diagonal they are mirrored.
    double u = std::fmod(0.7548776662466927 * static_cast<double>(i), 1.0);
    double v = std::fmod(0.5698402909980532 * static_cast<double>(i), 1.0);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto& [a, b, c] = map.triangles[triangle];
    points.push_back(a + u * (b - a) + v * (c - a));
  }
  return points;
}

}  // namespace slcmap::evaluation
