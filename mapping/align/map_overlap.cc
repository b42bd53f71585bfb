#include "mapping/align/map_overlap.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <unordered_set>

#include "data/core/math.h"
#include "mapping/align/map_agreement.h"
#include "mapping/align/plan_votes.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kShiftCell_m = 0.12;
constexpr int kMostShiftCells = 4000;  // of a side of the plan: buildings of some 200 m
constexpr int kShiftsOfTurn = 2;
constexpr double kUprightShare = 0.5;  // of an edge that is not level
constexpr double kBetweenShifts_m = 0.5;
constexpr double kKnownCube_m = 1;     // around edges: there the map has looked
constexpr double kNearWalk_m = 2;      // in the plan
constexpr double kSameStorey_m = 1.2;  // in height

// An edge of a place that both maps have looked at is in both with the first probability, and
// beside another by chance with the second, within kEdgeReach_m. Neighbours on an edge tell the
// same.
constexpr double kBothHaveIt = 0.55, kByChance = 0.08;
constexpr double kEdgeReach_m = 0.12, kOneEdge_m = 2;
// Places in the plan, turns and heights that are tried by the votes.
const double kPlaces = std::log(1e5);

struct PlanShift {
  Vector2d shift = Vector2d::Zero();
  double votes = 0;
};

// The shifts that bring most of the uprights onto others, the best first.
std::vector<PlanShift> VoteForShifts(const std::vector<Vector2d>& first,
                                     const std::vector<Vector2d>& second) {
  if (first.empty() || second.empty()) return {};
  const auto bound = [](const std::vector<Vector2d>& points, bool upper) {
    Vector2d found = points.front();
    for (const Vector2d& p : points) {
      found = upper ? found.cwiseMax(p).eval() : found.cwiseMin(p).eval();
    }
    return found;
  };
  const Vector2d least = bound(first, false) - bound(second, true);
  const Vector2d most = bound(first, true) - bound(second, false);
  const double cell_m = std::max(kShiftCell_m, (most - least).maxCoeff() / kMostShiftCells);
  const Eigen::Vector2i cells = ((most - least) / cell_m).cast<int>() + Eigen::Vector2i(1, 1);
  cv::Mat1f votes(cells.y(), cells.x(), 0.F);
  for (const Vector2d& a : first) {
    for (const Vector2d& b : second) {
      const Eigen::Vector2i cell = ((a - b - least) / cell_m).cast<int>();
      votes(cell.y(), cell.x()) += 1;
    }
  }
  cv::boxFilter(votes, votes, -1, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
  std::vector<PlanShift> shifts;
  const int apart = static_cast<int>(std::lround(kBetweenShifts_m / cell_m));
  for (int i = 0; i < kShiftsOfTurn; ++i) {
    double highest = 0;
    cv::Point at;
    cv::minMaxLoc(votes, nullptr, &highest, nullptr, &at);
    if (highest <= 0) break;
    shifts.push_back({least + cell_m * (Vector2d(at.x, at.y) + Vector2d(0.5, 0.5)), highest});
    cv::circle(votes, at, apart, 0, cv::FILLED);
  }
  return shifts;
}

}  // namespace

struct IndexedMap::Contents {
  explicit Contents(const PlaceIndex& places)
      : features(FindFeatures(places.edges)), index(features), walk_world(places.walk_world) {
    for (const MapLine& edge : places.edges) {
      const Vector3d way = edge.end_world - edge.start_world;
      if (std::abs(way.z()) < kUprightShare * way.norm()) continue;
      uprights.push_back((edge.start_world + 0.5 * way).head<2>());
    }
    for (const LinePlace& place : features.lines) AddKnown(place.p_world);
    for (const Vector3d& p : walk_world) AddKnown(p);
  }

  void AddKnown(const Vector3d& p) {
    const Eigen::Vector3i cube = FindCube(p, kKnownCube_m);
    for (int i = 0; i < kCubesAround; ++i) known.insert(MakeKey(CubeAround(cube, i)));
  }

  // Of another map's edges at a place, by what of them is here.
  double LogOdds(const Contents& second, const RigidTransform& T) const {
    constexpr double kItems = kLinePlace_m / kOneEdge_m;
    const double for_it = std::log(kBothHaveIt / kByChance),
                 against = std::log((1 - kBothHaveIt) / (1 - kByChance));
    double sum = -kPlaces;
    for (const LinePlace& place : second.features.lines) {
      const Vector3d p = T * place.p_world;
      if (!known.contains(MakeKey(FindCube(p, kKnownCube_m)))) continue;
      const bool is_here = index.LineNear(p, T.rotation * place.direction_world, kEdgeReach_m);
      sum += kItems * (is_here ? for_it : against);
    }
    return sum;
  }

  const AlignmentFeatures features;
  const FeatureIndex index;
  std::vector<Vector2d> uprights;
  std::unordered_set<int64_t> known;
  std::vector<Vector3d> walk_world;
};

IndexedMap::IndexedMap(const PlaceIndex& index)
    : contents_(std::make_unique<const Contents>(index)) {}
IndexedMap::~IndexedMap() = default;
IndexedMap::IndexedMap(IndexedMap&&) noexcept = default;

MapOverlap IndexedMap::FindOverlap(const IndexedMap& second) const {
  const Contents &ours = *contents_, &theirs = *second.contents_;
  const std::vector<double> heights_m = FindHeights(ours.features, theirs.features, {});
  MapOverlap best;
  for (const auto& [yaw_rad, heading_rad] : FindTurns(ours.features, theirs.features, {})) {
    const RigidTransform turn = LevelTransform(yaw_rad, Vector3d::Zero());
    std::vector<Vector2d> turned;
    for (const Vector2d& p : theirs.uprights) {
      turned.emplace_back((turn * Vector3d(p.x(), p.y(), 0)).head<2>());
    }
    for (const PlanShift& found : VoteForShifts(ours.uprights, turned)) {
      for (const double height_m : heights_m) {
        const Vector3d p(found.shift.x(), found.shift.y(), height_m);
        const double log_odds = ours.LogOdds(theirs, LevelTransform(yaw_rad, p));
        if (log_odds > best.log_odds) best = {log_odds, {p, yaw_rad}};
      }
    }
  }
  return best;
}

double IndexedMap::ShareOfWalk(const IndexedMap& second,
                               const RigidTransform& T_this_second) const {
  const std::vector<Vector3d>& walk = second.contents_->walk_world;
  const auto is_near = [&](const Vector3d& place) {
    const Vector3d p = T_this_second * place;
    return std::ranges::any_of(contents_->walk_world, [&](const Vector3d& ours) {
      return (ours - p).head<2>().norm() < kNearWalk_m &&
             std::abs(ours.z() - p.z()) < kSameStorey_m;
    });
  };
  if (walk.empty()) return 0;
  return static_cast<double>(std::ranges::count_if(walk, is_near)) /
         static_cast<double>(walk.size());
}

double IndexedMap::WalkHeight_m() const {
  std::vector<double> heights_m;
  for (const Vector3d& p : contents_->walk_world) heights_m.push_back(p.z());
  return Quantile(std::move(heights_m), 0.5);
}

Vector3d IndexedMap::WalkMiddle() const {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : contents_->walk_world) sum += p;
  return sum / static_cast<double>(std::max<std::size_t>(1, WalkPlaces()));
}

std::size_t IndexedMap::WalkPlaces() const { return contents_->walk_world.size(); }

std::vector<MapPair> FindOverlaps(const std::vector<IndexedMap>& maps, std::size_t map) {
  std::vector<MapPair> pairs;
  for (std::size_t before = 0; before < map; ++before) {
    pairs.push_back({before, map, maps[before].FindOverlap(maps[map])});
  }
  std::ranges::stable_sort(pairs, std::greater(),
                           [](const MapPair& pair) { return pair.overlap.log_odds; });
  return pairs;
}

}  // namespace slcmap::mapping
