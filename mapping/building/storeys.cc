#include "mapping/building/storeys.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPlace_m = 0.25;  // between places of the thinned trajectory
constexpr double kHeightBin_m = 0.02;
constexpr int kFloorReach = 2, kCeilingReach = 6;  // columns around a place
constexpr double kLeastBelow_m = 0.2, kLeastAbove_m = 0.05;
constexpr int kMeanRounds = 5;
constexpr double kSameFloor_m = 0.12, kSamePeak_m = 0.05;
constexpr size_t kLeastColumns = 16;   // 1 m2
constexpr double kLeastCeiling = 0.1;  // of as many columns as have a floor
constexpr double kSlack_m = 0.05;      // of a storey's floor and top

// Heights of level surfaces that face one way, by column, ascending.
using Surfaces = std::map<PlanColumn, std::vector<double>>;

Surfaces LevelSurfaces(const std::vector<SurfacePoint>& points, double way) {
  Surfaces surfaces;
  for (const SurfacePoint& point : points) {
    if (way * point.normal_world.z() < kLevelCosine) continue;
    surfaces[FindColumn(point.p_world.head<2>())].push_back(point.p_world.z());
  }
  for (auto& [column, heights] : surfaces) std::sort(heights.begin(), heights.end());
  return surfaces;
}

std::vector<Vector3d> Thinned(const std::vector<Vector3d>& trajectory) {
  std::vector<Vector3d> places;
  for (const Vector3d& p : trajectory) {
    if (places.empty() || (p - places.back()).norm() >= kPlace_m) places.push_back(p);
  }
  return places;
}

// The first surface below, or above, each column around some places: the height that they see.
class FirstSurfaces {
 public:
  FirstSurfaces(const Surfaces& surfaces, bool below) : surfaces_(surfaces), below_(below) {}

  void AddAround(const Vector3d& place, int reach) {
    const PlanColumn middle = FindColumn(place.head<2>());
    for (int i = -reach; i <= reach; ++i) {
      for (int j = -reach; j <= reach; ++j) {
        const PlanColumn column{middle.first + i, middle.second + j};
        if (const auto height_m = First(column, place.z())) heights_[column] = *height_m;
      }
    }
  }

  // The height that most columns have, within a peak's width; empties those columns, and all
  // within `around_m`, of it. Nothing where less than `least` columns have it.
  std::optional<double> TakePeak(size_t least, double around_m, size_t* count = nullptr) {
    std::map<int, size_t> histogram;
    for (const auto& [column, height_m] : heights_) ++histogram[FindBin(height_m)];
    double best_m = 0;
    size_t most = 0;
    for (const auto& [bin, unused] : histogram) {
      const size_t here = InPeak(histogram, bin);
      if (here > most) {
        most = here;
        best_m = (bin + 0.5) * kHeightBin_m;
      }
    }
    if (most < std::max<size_t>(least, 1)) return std::nullopt;
    if (count != nullptr) *count = most;
    // What is seen first is rather the nearer side of the noise: the mean moves to the middle.
    double mean_m = best_m;
    for (int round = 0; round < kMeanRounds; ++round) mean_m = MeanNear(mean_m);
    std::erase_if(heights_, [&](const auto& entry) {
      return std::abs(entry.second - mean_m) <= around_m ||
             std::abs(entry.second - best_m) <= kSamePeak_m;
    });
    return mean_m;
  }

  size_t size() const { return heights_.size(); }

 private:
  static int FindBin(double height_m) {
    return static_cast<int>(std::floor(height_m / kHeightBin_m));
  }

  static size_t InPeak(const std::map<int, size_t>& histogram, int bin) {
    size_t count = 0;
    for (int k = bin - 1; k <= bin + 1; ++k) {
      const auto found = histogram.find(k);
      if (found != histogram.end()) count += found->second;
    }
    return count;
  }

  std::optional<double> First(const PlanColumn& column, double z_m) const {
    const auto found = surfaces_.find(column);
    if (found == surfaces_.end()) return std::nullopt;
    const std::vector<double>& heights = found->second;
    if (below_) {
      const auto above = std::upper_bound(heights.begin(), heights.end(), z_m - kLeastBelow_m);
      if (above == heights.begin()) return std::nullopt;
      return *(above - 1);
    }
    const auto above = std::lower_bound(heights.begin(), heights.end(), z_m + kLeastAbove_m);
    if (above == heights.end()) return std::nullopt;
    return *above;
  }

  // Of all surfaces in these columns that are in the peak, not just of the first ones.
  double MeanNear(double height_m) const {
    double sum_m = 0;
    int64_t count = 0;
    for (const auto& [column, unused] : heights_) {
      for (const double z_m : surfaces_.at(column)) {
        if (std::abs(z_m - height_m) > kSamePeak_m) continue;
        sum_m += z_m;
        ++count;
      }
    }
    return count > 0 ? sum_m / static_cast<double>(count) : height_m;
  }

  const Surfaces& surfaces_;
  const bool below_;
  std::map<PlanColumn, double> heights_;
};

// The floor that most columns beneath a place have.
std::optional<size_t> FloorBelow(const Surfaces& floors, const std::vector<Level>& levels,
                                 const Vector3d& place) {
  FirstSurfaces below(floors, true);
  below.AddAround(place, kFloorReach);
  const auto height_m = below.TakePeak(1, kSamePeak_m);
  if (!height_m) return std::nullopt;
  for (size_t i = 0; i < levels.size(); ++i) {
    if (std::abs(levels[i].floor_m - *height_m) <= kSameFloor_m) return i;
  }
  return std::nullopt;
}

double MedianHeight(std::vector<Vector3d> places) {
  std::nth_element(places.begin(), places.begin() + static_cast<int64_t>(places.size() / 2),
                   places.end(),
                   [](const Vector3d& a, const Vector3d& b) { return a.z() < b.z(); });
  return places[places.size() / 2].z();
}

// The trajectory follows a floor when it is as much higher over it as the floor is.
bool IsFollowed(const Level& level, const std::vector<Level>& accepted) {
  if (level.places.size() < 2) return false;
  return std::all_of(accepted.begin(), accepted.end(), [&](const Level& other) {
    const double step_m = level.floor_m - other.floor_m;
    const double rise_m = MedianHeight(level.places) - MedianHeight(other.places);
    return std::abs(rise_m - step_m) <= 0.5 * std::abs(step_m);
  });
}

std::vector<Level> Candidates(const Surfaces& floors, const std::vector<Vector3d>& places) {
  FirstSurfaces below(floors, true);
  for (const Vector3d& place : places) below.AddAround(place, kFloorReach);
  std::vector<Level> candidates;
  while (const auto floor_m = below.TakePeak(kLeastColumns, kSameFloor_m)) {
    candidates.push_back({*floor_m, {}, 0, {}});
  }
  for (const Vector3d& place : places) {
    if (const auto level = FloorBelow(floors, candidates, place)) {
      candidates[*level].places.push_back(place);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Level& a, const Level& b) {
    return a.places.size() > b.places.size();
  });
  return candidates;
}

// Gives each place to the level whose usual height over its floor it fits best; what the level's
// own places are, was only known where its floor was seen.
void AssignPlaces(const std::vector<Vector3d>& places, const Surfaces& floors,
                  std::vector<Level>* levels) {
  std::vector<double> usual_m;
  for (Level& level : *levels) {
    usual_m.push_back(level.places.empty() ? level.floor_m + 1.5 : MedianHeight(level.places));
    level.places.clear();
  }
  for (const Vector3d& place : places) {
    size_t best = 0;
    if (const auto below = FloorBelow(floors, *levels, place)) {
      best = *below;
    } else {
      for (size_t i = 1; i < levels->size(); ++i) {
        if (std::abs(place.z() - usual_m[i]) < std::abs(place.z() - usual_m[best])) best = i;
      }
    }
    (*levels)[best].places.push_back(place);
  }
}

bool IsUpright(const SurfacePoint& point) {
  return point.normal_world.norm() > 0.5 && std::abs(point.normal_world.z()) < 0.3;
}

// The height below which a share of the upright points between two heights is.
double UprightQuantile(const std::vector<SurfacePoint>& points, double low_m, double high_m,
                       double share, double otherwise_m) {
  std::vector<double> heights;
  for (const SurfacePoint& point : points) {
    const double z_m = point.p_world.z();
    if (IsUpright(point) && z_m > low_m && z_m < high_m) heights.push_back(z_m);
  }
  if (heights.empty()) return otherwise_m;
  const auto at =
      heights.begin() + static_cast<int64_t>(share * static_cast<double>(heights.size() - 1));
  std::nth_element(heights.begin(), at, heights.end());
  return *at;
}

Level LevelWithoutFloor(const BuildingInput& input, const std::vector<Vector3d>& places) {
  constexpr double kHolding_m = 1.5;  // height of a rig over the floor, where nothing is known
  const double z_m = MedianHeight(places);
  const double infinity = std::numeric_limits<double>::infinity();
  Level level;
  level.floor_m = UprightQuantile(input.points, -infinity, z_m, 0.01, z_m - kHolding_m);
  level.places = places;
  return level;
}

void FindCeiling(const Surfaces& ceilings, size_t floor_columns, Level* level) {
  FirstSurfaces above(ceilings, false);
  for (const Vector3d& place : level->places) above.AddAround(place, kCeilingReach);
  const auto least = std::max(
      static_cast<size_t>(kLeastCeiling * static_cast<double>(floor_columns)), kLeastColumns);
  size_t columns = 0;
  level->ceiling_m = above.TakePeak(least, kSamePeak_m, &columns);
  if (!level->ceiling_m) return;
  // Lamps and ducts have more texture than the blank ceiling that they hang under.
  const double hung_m = *level->ceiling_m;
  const auto enough = std::max(kLeastColumns, columns / kHungOver);
  while (const auto higher_m = above.TakePeak(enough, kSamePeak_m)) {
    if (*higher_m <= hung_m + kHung_m) level->ceiling_m = std::max(*level->ceiling_m, *higher_m);
  }
}

double SquaredPlanDistance(const Level& level, const Vector3d& p_world) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& place : level.places) {
    nearest = std::min(nearest, (place - p_world).head<2>().squaredNorm());
  }
  return nearest;
}

// Lengths of level edges that are seen well around a level's places, by height.
std::map<double, double> LevelEdges(const std::vector<MapLine>& lines, const Level& level) {
  constexpr double kSlope = 0.05, kReach_m2 = 8 * 8, kMaxSigma_m = 0.05;
  std::map<double, double> lengths_m;
  for (const MapLine& line : lines) {
    const Vector3d way = line.end_world - line.start_world, middle = line.start_world + 0.5 * way;
    if (line.kind != LineKind::kEdge || std::abs(way.z()) > kSlope * way.norm()) continue;
    if (line.sigma_m > kMaxSigma_m || SquaredPlanDistance(level, middle) > kReach_m2) continue;
    lengths_m[middle.z()] += way.norm();
  }
  return lengths_m;
}

// A blank ceiling shows no surface, but the edges where walls and lamps meet it: the highest place
// between two heights with some of them, where enough hang beneath it, what stands upright is seen
// up to nearly there, and hardly anything stands above it.
std::optional<double> FindCeilingOfEdges(const BuildingInput& input, const Level& level,
                                         double low_m, double high_m) {
  constexpr double kLeastEdges_m = 4, kMostAbove = 0.005;
  if (low_m >= high_m) return std::nullopt;
  const std::map<double, double> edges = LevelEdges(input.lines, level);
  const double seen_m = UprightQuantile(input.points, low_m, high_m, 1 - kMostAbove, low_m);
  for (auto top = edges.lower_bound(high_m); top != edges.lower_bound(low_m); --top) {
    const double top_m = std::prev(top)->first;
    double here_m = 0, moment_m2 = 0, hung_m = 0;
    for (auto edge = edges.lower_bound(std::max(low_m, top_m - kHung_m)); edge != top; ++edge) {
      hung_m += edge->second;
      if (edge->first < top_m - kSamePeak_m) continue;
      here_m += edge->second;
      moment_m2 += edge->second * edge->first;
    }
    if (hung_m < kLeastEdges_m || here_m * kHungOver < kLeastEdges_m) continue;
    const double ceiling_m = moment_m2 / here_m;
    if (seen_m < ceiling_m - kHung_m) continue;
    return seen_m <= ceiling_m + kSamePeak_m ? std::optional(ceiling_m) : std::nullopt;
  }
  return std::nullopt;
}

void FindTops(const BuildingInput& input, std::vector<Level>* levels) {
  constexpr double kLeastStorey_m = 1.9;
  constexpr double kTopShare = 0.995;
  for (Level& level : *levels) {
    double limit_m = std::numeric_limits<double>::infinity();
    for (const Level& other : *levels) {
      if (other.floor_m > level.floor_m + kLeastStorey_m)
        limit_m = std::min(limit_m, other.floor_m);
    }
    const double least_m = level.floor_m + kLeastStorey_m;
    if (!level.ceiling_m) {
      level.ceiling_m = FindCeilingOfEdges(input, level, least_m, limit_m - 2 * kSamePeak_m);
    }
    level.top_m = level.ceiling_m.value_or(std::max(
        least_m, UprightQuantile(input.points, level.floor_m, limit_m, kTopShare, least_m)));
  }
}

}  // namespace

std::vector<Level> FindLevels(const BuildingInput& input) {
  const std::vector<Vector3d> places = Thinned(input.trajectory_world);
  if (places.empty()) return {};
  const Surfaces floors = LevelSurfaces(input.points, 1),
                 ceilings = LevelSurfaces(input.points, -1);
  std::vector<Level> levels;
  for (const Level& candidate : Candidates(floors, places)) {
    if (levels.empty() || IsFollowed(candidate, levels)) levels.push_back(candidate);
  }
  if (levels.empty()) levels.push_back(LevelWithoutFloor(input, places));
  AssignPlaces(places, floors, &levels);
  std::erase_if(levels, [](const Level& level) { return level.places.empty(); });
  std::sort(levels.begin(), levels.end(),
            [](const Level& a, const Level& b) { return a.floor_m < b.floor_m; });
  for (Level& level : levels) {
    FirstSurfaces below(floors, true);
    for (const Vector3d& place : level.places) below.AddAround(place, kFloorReach);
    FindCeiling(ceilings, below.size(), &level);
  }
  FindTops(input, &levels);
  return levels;
}

int LevelAt(const std::vector<Level>& levels, const Vector3d& p_world) {
  std::vector<int> holding;
  for (size_t i = 0; i < levels.size(); ++i) {
    if (p_world.z() > levels[i].floor_m - kSlack_m && p_world.z() < levels[i].top_m + kSlack_m) {
      holding.push_back(static_cast<int>(i));
    }
  }
  if (holding.empty()) return -1;
  if (holding.size() == 1) return holding.front();
  return *std::min_element(holding.begin(), holding.end(), [&](int a, int b) {
    return SquaredPlanDistance(levels[a], p_world) < SquaredPlanDistance(levels[b], p_world);
  });
}

}  // namespace slcmap::mapping
