#include "mapping/align/map_changes.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <set>

#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kLeastChange_m2 = 0.4;
constexpr double kCluster_m = 0.3;  // cubes that touch each other are of one thing
// Of a wall.
constexpr double kLevelNormal_z = 0.3, kMostlyLevel = 0.8, kWallHeight_m = 1.8, kWallLength_m = 1,
                 kWallDepth_m = 0.3;
// Around a surface that is gone, what is gone with it.
constexpr double kAroundGone_m = 0.15, kGoneFacing = 0.5, kGoneShare = 0.7;

// The samples of a map that contradict what the other saw.
std::vector<SurfaceSample> Contradicted(const ComparedMap& of, const ComparedMap& by,
                                        const RigidTransform& T_by_of) {
  const MapAgreement agreement = Compare(by, of, T_by_of);
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < agreement.surfaces.size(); ++i) {
    if (agreement.surfaces[i] == Answer::kContradicts) samples.push_back(of.features.surfaces[i]);
  }
  return samples;
}

// Samples in cubes that touch each other, group by group, in the order of their first ones.
std::vector<std::vector<SurfaceSample>> Cluster(const std::vector<SurfaceSample>& samples) {
  std::unordered_map<int64_t, std::vector<std::size_t>> cubes;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    cubes[MakeKey(FindCube(samples[i].p_world, kCluster_m))].push_back(i);
  }
  std::vector<bool> is_taken(samples.size());
  std::vector<std::vector<SurfaceSample>> clusters;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (is_taken[i]) continue;
    is_taken[i] = true;
    std::vector<SurfaceSample>& cluster = clusters.emplace_back();
    for (std::deque<std::size_t> left = {i}; !left.empty(); left.pop_front()) {
      cluster.push_back(samples[left.front()]);
      const Eigen::Vector3i cube = FindCube(samples[left.front()].p_world, kCluster_m);
      for (int k = 0; k < kCubesAround; ++k) {
        const auto near = cubes.find(MakeKey(CubeAround(cube, k)));
        if (near == cubes.end()) continue;
        for (const std::size_t other : near->second) {
          if (is_taken[other]) continue;
          is_taken[other] = true;
          left.push_back(other);
        }
      }
    }
  }
  return clusters;
}

bool IsWall(const MapChange& change) {
  const auto level = std::ranges::count_if(change.surfaces, [](const SurfaceSample& sample) {
    return std::abs(sample.normal_world.z()) < kLevelNormal_z;
  });
  const Eigen::Vector3d size = change.most_world - change.least_world;
  return static_cast<double>(level) >= kMostlyLevel * static_cast<double>(change.surfaces.size()) &&
         size.z() >= kWallHeight_m && size.head<2>().maxCoeff() >= kWallLength_m &&
         size.head<2>().minCoeff() <= kWallDepth_m;
}

MapChange MakeChange(bool is_new, std::vector<SurfaceSample> surfaces) {
  MapChange change;
  change.is_new = is_new;
  change.area_m2 = static_cast<double>(surfaces.size()) * kSurfaceSample_m * kSurfaceSample_m;
  change.least_world = change.most_world = surfaces.front().p_world;
  for (const SurfaceSample& sample : surfaces) {
    change.least_world = change.least_world.cwiseMin(sample.p_world);
    change.most_world = change.most_world.cwiseMax(sample.p_world);
  }
  change.surfaces = std::move(surfaces);
  change.is_wall = IsWall(change);
  return change;
}

// What stood where surfaces are gone.
class GonePlaces {
 public:
  explicit GonePlaces(const std::vector<MapChange>& changes) {
    for (const MapChange& change : changes) {
      if (change.is_new) continue;
      for (const SurfaceSample& sample : change.surfaces) {
        index_.Add(sample.p_world, normals_.size());
        normals_.push_back(sample.normal_world);
      }
    }
  }

  bool Holds(const Eigen::Vector3d& p) const { return index_.HasNear(p, kAroundGone_m); }
  bool Holds(const DensePoint& point) const {
    return index_.AnyNear(point.p_world, kAroundGone_m, [&](std::size_t i) {
      return normals_[i].dot(point.normal_world) > kGoneFacing;
    });
  }
  bool Holds(const MapLine& line) const {
    constexpr int kPlacesOfLine = 20;
    int gone = 0;
    for (int i = 0; i < kPlacesOfLine; ++i) {
      gone +=
          Holds(line.start_world + (i + 0.5) / kPlacesOfLine * (line.end_world - line.start_world));
    }
    return gone >= kGoneShare * kPlacesOfLine;
  }

 private:
  PointIndex index_{kAroundGone_m};
  std::vector<Eigen::Vector3d> normals_;
};

// Lines of which all pieces are gone; others stay as they are, as do what is known of them.
void RemoveLines(const GonePlaces& gone, MapResult* map) {
  std::set<int64_t> kept, all;
  for (const auto* lines : {&map->lines, &map->marks}) {
    for (const MapLine& line : *lines) {
      all.insert(line.id);
      if (!gone.Holds(line)) kept.insert(line.id);
    }
  }
  const auto is_gone = [&](int64_t id) { return all.contains(id) && !kept.contains(id); };
  for (auto* lines : {&map->lines, &map->marks}) {
    std::erase_if(*lines, [&](const MapLine& line) { return is_gone(line.id); });
  }
  std::erase_if(map->line_evidence.covariances,
                [&](const LineCovariance& row) { return is_gone(row.line_id); });
  std::erase_if(map->line_evidence.supports,
                [&](const LineSupport& row) { return is_gone(row.line_id); });
}

void RemovePoints(const GonePlaces& gone, MapResult* map) {
  std::vector<int64_t> moved_to(map->points.size(), -1);
  std::vector<MapPoint> kept;
  for (std::size_t i = 0; i < map->points.size(); ++i) {
    if (gone.Holds(map->points[i].p_world)) continue;
    moved_to[i] = std::ssize(kept);
    kept.push_back(std::move(map->points[i]));
  }
  map->points = std::move(kept);
  std::erase_if(map->point_observations, [&](MapPointObservation& seen) {
    seen.point = moved_to[static_cast<std::size_t>(seen.point)];
    return seen.point < 0;
  });
}

}  // namespace

std::vector<MapChange> FindChanges(const ComparedMap& earlier, const ComparedMap& later,
                                   const RigidTransform& T_earlier_later) {
  std::vector<MapChange> changes;
  const auto add = [&](bool is_new, const std::vector<SurfaceSample>& samples) {
    for (std::vector<SurfaceSample>& cluster : Cluster(samples)) {
      MapChange change = MakeChange(is_new, std::move(cluster));
      if (change.area_m2 >= kLeastChange_m2) changes.push_back(std::move(change));
    }
  };
  add(false, Contradicted(earlier, later, T_earlier_later.Inverse()));
  std::vector<SurfaceSample> appeared = Contradicted(later, earlier, T_earlier_later);
  for (SurfaceSample& sample : appeared) {
    sample.p_world = T_earlier_later * sample.p_world;
    sample.normal_world = T_earlier_later.rotation * sample.normal_world;
  }
  add(true, appeared);
  std::ranges::stable_sort(changes, std::greater(), &MapChange::area_m2);
  return changes;
}

void RemoveGone(const std::vector<MapChange>& changes, MapResult* earlier) {
  const GonePlaces gone(changes);
  std::erase_if(earlier->dense, [&](const DensePoint& point) { return gone.Holds(point); });
  RemoveLines(gone, earlier);
  RemovePoints(gone, earlier);
}

}  // namespace slcmap::mapping
