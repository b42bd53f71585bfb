#include "mapping/merge/surface_union.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

namespace slcmap {
namespace {

constexpr double kLeastSigma_m = 0.001;
constexpr double kOneSurface = 0.7;     // cosine between normals
constexpr double kOneSigmas = 3;        // along the normal, between points of one surface
constexpr double kBesidesVoxels = 0.6;  // across it, from where they are two points

using SideVoxel = std::array<int64_t, 4>;  // and the side that it faces

struct SideVoxelHash {
  std::size_t operator()(const SideVoxel& voxel) const {
    uint64_t hash = 0;
    for (const int64_t index : voxel)
      hash = (hash ^ static_cast<uint64_t>(index)) * 0x9E3779B97F4A7C15;
    return hash ^ (hash >> 29);
  }
};

SideVoxel VoxelOf(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, double voxel_m) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const auto index = [&](int i) { return static_cast<int64_t>(std::floor(p[i] / voxel_m)); };
  return {index(0), index(1), index(2), 2 * axis + (normal[axis] < 0 ? 1 : 0)};
}

struct SurfaceSum {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double weight = 0, grey = 0, filled = 0, best_sigma_m = 1e9;

  void Add(const DensePoint& point) {
    const double sigma_m = std::max(point.sigma_m, kLeastSigma_m), w = 1 / (sigma_m * sigma_m);
    p += w * point.p_world;
    normal += w * point.normal_world;
    weight += w;
    grey += w * point.grey;
    filled += point.source == DenseSource::kFilledPlane ? w : 0;
    best_sigma_m = std::min(best_sigma_m, point.sigma_m);
  }

  // Errors of one map are shared by its neighbours, so sigma is at best that of the mean of two.
  DensePoint Mean() const {
    const double sigma_m = std::max(std::sqrt(1 / weight), best_sigma_m / std::sqrt(2.0));
    return {p / weight, normal.normalized(), std::min(sigma_m, best_sigma_m),
            static_cast<uint8_t>(std::lround(grey / weight)),
            filled > 0.5 * weight ? DenseSource::kFilledPlane : DenseSource::kStereo};
  }
};

// Of points along a normal, as where a surface lies on the border of voxels, the best known stays.
std::vector<DensePoint> WithoutDoubles(const std::vector<DensePoint>& points, double alignment_m,
                                       double voxel_m) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].sigma_m < points[b].sigma_m;
  });
  std::unordered_map<SideVoxel, std::vector<std::size_t>, SideVoxelHash> kept;
  const auto is_double = [&](const DensePoint& point, const DensePoint& other) {
    if (other.normal_world.dot(point.normal_world) < kOneSurface) return false;
    const Eigen::Vector3d way = point.p_world - other.p_world;
    const double along_m = way.dot(other.normal_world);
    const double across_m = (way - along_m * other.normal_world).norm();
    const double sigma_m = std::hypot(point.sigma_m, other.sigma_m, alignment_m);
    return across_m < kBesidesVoxels * voxel_m &&
           std::abs(along_m) < std::min(kOneSigmas * sigma_m, 1.5 * voxel_m);
  };
  std::vector<char> stays(points.size(), 0);
  for (const std::size_t i : order) {
    const SideVoxel voxel = VoxelOf(points[i].p_world, points[i].normal_world, voxel_m);
    bool doubles = false;
    for (int k = 0; k < 125 && !doubles; ++k) {
      const auto found = kept.find(
          {voxel[0] + k % 5 - 2, voxel[1] + k / 5 % 5 - 2, voxel[2] + k / 25 - 2, voxel[3]});
      if (found == kept.end()) continue;
      doubles = std::any_of(found->second.begin(), found->second.end(),
                            [&](std::size_t other) { return is_double(points[i], points[other]); });
    }
    if (doubles) continue;
    stays[i] = 1;
    kept[voxel].push_back(i);
  }
  std::vector<DensePoint> left;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (stays[i]) left.push_back(points[i]);
  }
  return left;
}

SideVoxel VoxelOf(const MapPoint& point, double voxel_m) {
  return VoxelOf(point.p_world, Eigen::Vector3d::UnitX(), voxel_m);
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
                                      const std::vector<DensePoint>& second, double alignment_m,
                                      double voxel_m) {
  std::map<SideVoxel, SurfaceSum> voxels;
  for (const std::vector<DensePoint>* points : {&first, &second}) {
    for (const DensePoint& point : *points) {
      voxels[VoxelOf(point.p_world, point.normal_world, voxel_m)].Add(point);
    }
  }
  std::vector<DensePoint> means;
  for (const auto& [voxel, sum] : voxels) means.push_back(sum.Mean());
  return WithoutDoubles(means, alignment_m, voxel_m);
}

UnitedPoints UnitePoints(const UnitedPoints& first, const UnitedPoints& second, double voxel_m) {
  std::map<SideVoxel, PointSum> voxels;
  for (const UnitedPoints* map : {&first, &second}) {
    for (const MapPoint& point : map->points) voxels[VoxelOf(point, voxel_m)].Add(point);
  }
  UnitedPoints united;
  for (auto& [voxel, sum] : voxels) {
    sum.index = std::ssize(united.points);
    united.points.push_back(sum.Mean());
  }
  for (const UnitedPoints* map : {&first, &second}) {
    AddObservations(
        *map, [&](const MapPoint& p) { return &voxels.at(VoxelOf(p, voxel_m)); },
        &united.observations);
  }
  std::ranges::sort(united.observations, {},
                    [](const MapPointObservation& seen) { return KeyOf(seen); });
  return united;
}

}  // namespace slcmap
