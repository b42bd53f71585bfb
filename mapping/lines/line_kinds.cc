#include "mapping/lines/line_kinds.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "data/core/math.h"
#include "data/core/parallel.h"
#include "mapping/lines/line_fit.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kCell_m = 0.5;
// Below them steps (of the brightness) and sigmas are as good as the same.
constexpr double kLeastStep = 0.02, kLeastSigma_m = 0.0005;

}  // namespace

void LineCells::Add(int line) {
  for (const Eigen::Vector3i& cell : FindCells(line)) members_[MakeKey(cell)].push_back(line);
}

std::vector<int> LineCells::Near(int line) const {
  std::vector<int64_t> keys;
  for (const Eigen::Vector3i& cell : FindCells(line)) {
    for (int i = 0; i < kCubesAround; ++i) keys.push_back(MakeKey(CubeAround(cell, i)));
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<int> near;
  for (const int64_t key : keys) {
    const auto found = members_.find(key);
    if (found == members_.end()) continue;
    near.insert(near.end(), found->second.begin(), found->second.end());
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  return near;
}

std::vector<Eigen::Vector3i> LineCells::FindCells(int index) const {
  const TrackedLine& line = lines_[index];
  std::vector<Eigen::Vector3i> cells;
  for (const Interval& interval : line.intervals) {
    for (double along_m = interval.from_m;; along_m += kCell_m) {
      const Eigen::Vector3d p =
          line.line.point_world + std::min(along_m, interval.to_m) * line.line.direction_world;
      const Eigen::Vector3i cell = FindCube(p, kCell_m);
      if (cells.empty() || cells.back() != cell) cells.push_back(cell);
      if (along_m >= interval.to_m) break;
    }
  }
  return cells;
}

namespace {

// What each vote weighs, as tests/benchmarks/fit_line_votes.py found it on lines of simulated
// buildings whose edges are known, halls of brick and timber twice: a logistic regression. The
// constant is a tenth less, as an edge that is wrong is worse than one that is missing.
constexpr std::array<double, kLineVotes> kWeights{-0.372, 1.228,  3.185,  0.624,  -0.414, 0.726,
                                                  -0.575, 0.396,  3.037,  -0.944, 6.310,  -0.367,
                                                  -5.735, -3.433, -0.370, -3.661, -1.098};

}  // namespace

std::array<double, kLineVotes> CountVotes(const TrackedLine& line) {
  const SurfacesBeside& beside = line.surfaces;
  const double all_m = std::max(beside.flat_m + beside.relief_m + beside.unknown_m, 1e-9);
  const double flat = beside.flat_m / all_m, relief = beside.relief_m / all_m;
  const double brightness = std::max(line.brightness_sum, 1e-9);
  const double step = std::log(std::max(line.step_sum / brightness, kLeastStep));
  const double lasting = std::log(std::max(line.lasting_sum / brightness, kLeastStep));
  const double lasts = std::clamp(line.lasting_sum / std::max(line.step_sum, 1e-9), -1.0, 1.0);
  const double spread_px = line.fit.spread_px;
  return {1,
          flat,
          relief,
          step,
          step * step,
          flat * step,
          lasting,
          lasts,
          lasts * lasts,
          std::log1p(line.parallels),
          line.trim,
          std::log(std::max(line.fit.views, 3)),
          spread_px,
          spread_px * spread_px,
          std::log(std::max(line.fit.sigma_m(), kLeastSigma_m)),
          line.trim * std::log1p(line.parallels),
          relief * std::log1p(line.parallels)};
}

double ComputeEdgeProbability(const TrackedLine& line) {
  const std::array<double, kLineVotes> votes = CountVotes(line);
  const double log_odds = std::inner_product(votes.begin(), votes.end(), kWeights.begin(), 0.0);
  return 1 / (1 + std::exp(-log_odds));
}

namespace {

constexpr double kCountStep_m = 0.1;
constexpr double kBesideEnd_m = 0.1;      // past its ends, to which a line counts as beside a place
constexpr double kMaxTurn_rad = 0.06;     // between parallel lines
constexpr double kMinDistance_m = 0.012;  // between lines that are two
constexpr double kOffPlane_m = 0.03;
constexpr double kLeastTrim_m = 0.03, kMostTrim_m = 0.16;  // width
constexpr double kBeneath = 0.9;                           // cosine

double ShareOfRelief(const SurfacesBeside& beside) {
  return beside.relief_m / std::max(beside.flat_m + beside.relief_m + beside.unknown_m, 1e-9);
}

// How many differ, of sorted values.
int CountApart(const std::vector<double>& sorted) {
  int count = 0;
  double last = 0;
  for (const double value : sorted) {
    if (count > 0 && value - last <= kMinDistance_m) continue;
    last = value;
    ++count;
  }
  return count;
}

bool Covers(const TrackedLine& line, double along_m) {
  return std::any_of(line.intervals.begin(), line.intervals.end(), [&](const Interval& interval) {
    return along_m > interval.from_m - kBesideEnd_m && along_m < interval.to_m + kBesideEnd_m;
  });
}

class Neighbours {
 public:
  Neighbours(const std::vector<TrackedLine>& lines, const LineCells& cells, int index,
             double reach_m)
      : line_(lines[index].line), across_(ComputeAcross(line_.direction_world)), reach_m_(reach_m) {
    for (const int other : cells.Near(index)) {
      if (other == index || lines[other].segment != lines[index].segment) continue;
      const double cosine = line_.direction_world.dot(lines[other].line.direction_world);
      if (std::abs(cosine) > std::cos(kMaxTurn_rad)) parallel_.push_back(&lines[other]);
    }
  }

  int CountAt(double along_m) const {
    const std::vector<Eigen::Vector2d> places = PlacesAt(along_m);
    int most = 0;
    for (const Eigen::Vector2d& through : places) {  // the planes through one of them
      const Eigen::Vector2d way = through.normalized();
      std::vector<double> distances_m;
      for (const Eigen::Vector2d& place : places) {
        const double off_m = way.x() * place.y() - way.y() * place.x();
        if (std::abs(off_m) < kOffPlane_m) distances_m.push_back(way.dot(place));
      }
      std::sort(distances_m.begin(), distances_m.end());
      most = std::max(most, CountApart(distances_m));
    }
    return most;
  }

  // How much of a crease is beneath a level line, as near as the other edge of a skirting.
  double TrimAt(double along_m) const {
    double most = 0;
    ForPlacesAt(along_m, [&](const TrackedLine& other, const Eigen::Vector3d& way) {
      const double distance_m = way.norm();
      if (distance_m < kLeastTrim_m || distance_m > kMostTrim_m) return;
      if (way.z() < -kBeneath * distance_m) most = std::max(most, ShareOfRelief(other.surfaces));
    });
    return most;
  }

 private:
  // Calls `use` with each parallel line, and the way to it, where it passes the plane across the
  // line at a place of it.
  template <typename Use>
  void ForPlacesAt(double along_m, Use use) const {
    const Eigen::Vector3d p = line_.point_world + along_m * line_.direction_world;
    for (const TrackedLine* other : parallel_) {
      const double beside_m = other->line.direction_world.dot(p - other->line.point_world);
      if (!Covers(*other, beside_m)) continue;
      const Eigen::Vector3d q = other->line.point_world + beside_m * other->line.direction_world;
      use(*other, q - p);
    }
  }

  std::vector<Eigen::Vector2d> PlacesAt(double along_m) const {
    std::vector<Eigen::Vector2d> places;
    ForPlacesAt(along_m, [&](const TrackedLine&, const Eigen::Vector3d& way) {
      const Eigen::Vector2d place = across_.transpose() * way;
      const double distance_m = place.norm();
      if (distance_m > kMinDistance_m && distance_m < reach_m_) places.push_back(place);
    });
    return places;
  }

  const PointAndDirection& line_;
  const Eigen::Matrix<double, 3, 2> across_;
  const double reach_m_;
  std::vector<const TrackedLine*> parallel_;
};

void LookBeside(const Neighbours& neighbours, TrackedLine* line) {
  std::vector<double> counts;
  double trim = 0;
  for (const Interval& interval : line->intervals) {
    const double length_m = interval.length_m();
    const int places = std::max(1, static_cast<int>(length_m / kCountStep_m));
    for (int i = 0; i < places; ++i) {
      const double along_m = interval.from_m + (i + 0.5) * length_m / places;
      counts.push_back(neighbours.CountAt(along_m));
      trim += neighbours.TrimAt(along_m);
    }
  }
  line->trim = trim / std::max(1.0, static_cast<double>(counts.size()));
  line->parallels = static_cast<int>(Quantile(std::move(counts), 0.5));
}

}  // namespace

void CountParallels(double reach_m, std::vector<TrackedLine>* lines) {
  LineCells cells(*lines);
  const auto count = static_cast<int>(lines->size());
  for (int i = 0; i < count; ++i) cells.Add(i);
  ParallelFor(count, [&](size_t i) {
    LookBeside(Neighbours(*lines, cells, static_cast<int>(i), reach_m), &(*lines)[i]);
  });
}

}  // namespace slcmap::mapping
