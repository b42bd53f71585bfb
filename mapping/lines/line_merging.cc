#include "mapping/lines/line_merging.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "data/core/math.h"
#include "mapping/lines/line_kinds.h"

namespace slcmap::inline mapping {
namespace {

// Between lines, in the direction of what they are apart, as fits know them, whose places of one
// image err alike.
constexpr double kMaxSigmas = 6;
// up to which they are the same however well they are known
constexpr double kMergeMinDistance_m = 0.006;
// and beyond which they are not
constexpr double kMergeMaxDistance_m = 0.03;

constexpr double kIntervalLength_m = 0.25;
constexpr int kIntervalRounds = 4;
// A line that holds as a whole lends its certainty to its intervals.
constexpr double kIntervalSlack = 1.5;
// What is left of a line that does not hold as a whole; without an axis.
constexpr double kMinPart_m = 0.25, kMinFreePart_m = 0.5;

int IntervalAt(double along_m) { return static_cast<int>(std::floor(along_m / kIntervalLength_m)); }

// The places of a line, by index, in intervals along it.
class Intervals {
 public:
  explicit Intervals(const std::vector<EdgePoint>& places) : places_(places) {
    for (size_t i = 0; i < places.size(); ++i) {
      members_[IntervalAt(places[i].along_m)].push_back(i);
    }
  }

  // By how much the places of each interval scatter about a fit, px.
  std::map<int, double> Spreads(const LineFit& fit, const ViewCameras& cameras) const {
    const std::vector<double> off_px = OffLine_px(fit.line, fit.shift_m, places_, cameras);
    std::map<int, double> spreads;
    for (const auto& [index, members] : members_) {
      std::vector<double> values;
      for (const size_t i : members) values.push_back(off_px[i]);
      spreads[index] = ComputeSpread(std::move(values));
    }
    return spreads;
  }

  // The spread below which half of the places' intervals are.
  double ComputeMedianSpread(const std::map<int, double>& spreads) const {
    std::vector<double> by_place;
    for (const auto& [index, members] : members_) {
      by_place.insert(by_place.end(), members.size(), spreads.at(index));
    }
    return Quantile(std::move(by_place), 0.5);
  }

  std::vector<EdgePoint> PlacesIn(const std::map<int, double>& spreads, double most_px) const {
    std::vector<EdgePoint> places;
    for (const EdgePoint& place : places_) {
      if (spreads.at(IntervalAt(place.along_m)) <= most_px) places.push_back(place);
    }
    return places;
  }

 private:
  const std::vector<EdgePoint>& places_;
  std::map<int, std::vector<size_t>> members_;
};

// What is left of the intervals without the parts that scatter more.
std::vector<Interval> Without(const std::vector<Interval>& intervals,
                              const std::map<int, double>& spreads, double most_px,
                              double min_length_m) {
  std::vector<Interval> left = intervals;
  for (const auto& [index, spread_px] : spreads) {
    if (spread_px <= most_px) continue;
    const double from_m = index * kIntervalLength_m, to_m = from_m + kIntervalLength_m;
    std::vector<Interval> cut;
    for (const Interval& interval : left) {
      if (interval.to_m <= from_m || interval.from_m >= to_m) {
        cut.push_back(interval);
        continue;
      }
      if (interval.from_m < from_m) cut.push_back({interval.from_m, from_m});
      if (interval.to_m > to_m) cut.push_back({to_m, interval.to_m});
    }
    left = std::move(cut);
  }
  std::erase_if(left, [&](const Interval& interval) { return interval.length_m() < min_length_m; });
  return left;
}

// The fit to those intervals that agree with each other, found by leaving out, again and again, the
// half that scatters most.
std::optional<LineFit> FitToBest(const Intervals& intervals, const LineFit& whole,
                                 const TrackedLine& line, const ViewCameras& cameras,
                                 const std::optional<DirectionPrior>& prior,
                                 const LineFitOptions& options, double max_spread_px) {
  std::optional<LineFit> fit = whole;
  for (int round = 0; fit && round < kIntervalRounds && fit->spread_px > max_spread_px; ++round) {
    const std::map<int, double> spreads = intervals.Spreads(*fit, cameras);
    fit = FitLine(line.line, intervals.PlacesIn(spreads, intervals.ComputeMedianSpread(spreads)),
                  cameras, prior, options);
  }
  return fit;
}

}  // namespace

bool IntervalLimits::Hold(const LineFit& fit) const {
  return fit.views >= min_views && fit.sigma_m() <= max_sigma_m && fit.spread_px <= max_spread_px;
}

void DropPlacesOutside(TrackedLine* line) {
  std::erase_if(line->places, [&](const EdgePoint& place) {
    return std::none_of(line->intervals.begin(), line->intervals.end(),
                        [&](const Interval& interval) {
                          return place.along_m >= interval.from_m && place.along_m <= interval.to_m;
                        });
  });
}

std::optional<LineFit> FitIntervals(const ViewCameras& cameras,
                                    const std::optional<DirectionPrior>& prior,
                                    const LineFitOptions& options, const IntervalLimits& limits,
                                    TrackedLine* line) {
  const auto whole = FitLine(line->line, line->places, cameras, prior, options);
  if (!whole) return whole;
  const Intervals intervals(line->places);
  const auto best =
      FitToBest(intervals, *whole, *line, cameras, prior, options, limits.max_spread_px);
  if (!best) return whole;
  const std::map<int, double> spreads = intervals.Spreads(*best, cameras);
  const bool holds = limits.Hold(*whole);
  const double most_px = (holds ? kIntervalSlack : 1) * limits.max_spread_px;
  TrackedLine part = *line;
  part.intervals = Without(line->intervals, spreads, most_px, limits.min_length_m);
  DropPlacesOutside(&part);
  const double least_m = holds ? limits.min_length_m : prior ? kMinPart_m : kMinFreePart_m;
  if (TotalLength_m(part.intervals) < least_m) return whole;
  const auto fit = FitLine(line->line, part.places, cameras, prior, options);
  if (!fit || !limits.Hold(*fit)) return whole;
  line->intervals = std::move(part.intervals);
  line->places = std::move(part.places);
  return fit;
}

namespace {

constexpr double kMaxAngle_rad = 0.05;
constexpr double kSigmasBetweenMaps = 3;

// By how much of a line how many views know it.
double Quality(const TrackedLine& line) { return TotalLength_m(line.intervals) * line.fit.views; }

// An interval of `other` along `line`.
Interval Along(const PointAndDirection& line, const TrackedLine& other, const Interval& interval) {
  const auto at = [&](double along_m) {
    return line.direction_world.dot(other.line.point_world + along_m * other.line.direction_world -
                                    line.point_world);
  };
  const double a = at(interval.from_m), b = at(interval.to_m);
  return {std::min(a, b), std::max(a, b)};
}

// Where the two are compared: the middle of what they share along the first, or of their gap.
double MeetingPlace_m(const TrackedLine& a, const TrackedLine& b) {
  const Interval extent = Along(a.line, b, {b.intervals.front().from_m, b.intervals.back().to_m});
  const double from_m = std::max(a.intervals.front().from_m, extent.from_m);
  const double to_m = std::min(a.intervals.back().to_m, extent.to_m);
  return 0.5 * (from_m + to_m);
}

bool IsSameEdge(const TrackedLine& a, const TrackedLine& b, double between_maps_m) {
  if (a.segment != b.segment || a.axis != b.axis) return false;
  const double cosine = std::abs(a.line.direction_world.dot(b.line.direction_world));
  if (cosine < std::cos(kMaxAngle_rad)) return false;
  const double along_m = MeetingPlace_m(a, b);
  const Eigen::Vector3d p = a.line.point_world + along_m * a.line.direction_world;
  const double along_b_m = b.line.direction_world.dot(p - b.line.point_world);
  const Eigen::Vector3d q = b.line.point_world + along_b_m * b.line.direction_world;
  const double distance_m = (p - q).norm();
  if (distance_m <= kMergeMinDistance_m) return true;
  if (distance_m > kMergeMaxDistance_m) return false;
  // What each map had apart it keeps apart.
  if (between_maps_m > 0 && a.map == b.map) return false;
  const double between_m = a.map != b.map ? kSigmasBetweenMaps * between_maps_m : 0;
  const Eigen::Vector3d way = (p - q) / distance_m;
  const double sigma_m =
      std::hypot(a.fit.SigmaTowards_m(way, along_m), b.fit.SigmaTowards_m(way, along_b_m));
  return distance_m <= std::hypot(kMaxSigmas * sigma_m, between_m);
}

}  // namespace

std::vector<Interval> Union(std::vector<Interval> intervals, double max_gap_m) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.from_m < b.from_m; });
  std::vector<Interval> united;
  for (const Interval& interval : intervals) {
    if (!united.empty() && interval.from_m <= united.back().to_m + max_gap_m) {
      united.back().to_m = std::max(united.back().to_m, interval.to_m);
    } else {
      united.push_back(interval);
    }
  }
  return united;
}

namespace {

// Places of the other where the same image has none of the line's own: what it shows twice are two
// edges that lie beside each other.
void TakePlaces(const TrackedLine& other, TrackedLine* line) {
  std::map<std::pair<int, int>, std::vector<Interval>> own;  // by view and camera
  for (const EdgePoint& place : line->places) {
    own[{place.view, place.camera}].push_back({place.from_m, place.to_m});
  }
  for (EdgePoint place : other.places) {
    const Interval interval = Along(line->line, other, {place.from_m, place.to_m});
    const double middle_m = 0.5 * (interval.from_m + interval.to_m);
    const auto covers = [&](const Interval& mine) {
      return mine.from_m <= middle_m && mine.to_m >= middle_m;
    };
    if (std::ranges::any_of(own[{place.view, place.camera}], covers)) continue;
    const double along_m = Along(line->line, other, {place.along_m, place.along_m}).from_m;
    place.along_m = static_cast<float>(along_m);
    place.from_m = static_cast<float>(interval.from_m);
    place.to_m = static_cast<float>(interval.to_m);
    line->places.push_back(place);
  }
}

void TakeOver(const TrackedLine& other, TrackedLine* line) {
  constexpr double kGap_m = 0.04;
  for (const Interval& interval : other.intervals) {
    line->intervals.push_back(Along(line->line, other, interval));
  }
  line->intervals = Union(std::move(line->intervals), kGap_m);
  TakePlaces(other, line);
  line->fit.views = std::max(line->fit.views, other.fit.views);
}

// The best known first.
std::vector<int> ByQuality(const std::vector<TrackedLine>& lines) {
  std::vector<int> order(lines.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return Quality(lines[a]) > Quality(lines[b]); });
  return order;
}

}  // namespace

std::vector<TrackedLine> MergeLines(std::vector<TrackedLine> lines, double between_maps_m) {
  std::vector<std::vector<int>> groups(lines.size());  // by the line that leads it
  std::vector<int> leader(lines.size(), -1);
  std::map<int, LineCells> by_axis;  // only lines of one axis are compared
  for (const int i : ByQuality(lines)) {
    leader[i] = i;
    LineCells& cells = by_axis.try_emplace(lines[i].axis, lines).first->second;
    for (const int k : cells.Near(i)) {
      const std::vector<int>& group = groups[leader[k]];
      const bool fits_all = std::all_of(group.begin(), group.end(), [&](int member) {
        return IsSameEdge(lines[member], lines[i], between_maps_m);
      });
      if (!fits_all) continue;
      leader[i] = leader[k];
      break;
    }
    groups[leader[i]].push_back(i);
    cells.Add(i);
  }
  std::vector<TrackedLine> merged;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (groups[i].empty()) continue;
    TrackedLine& line = lines[i];
    for (const int member : groups[i]) {
      if (member != static_cast<int>(i)) TakeOver(lines[member], &line);
    }
    merged.push_back(std::move(line));
  }
  return merged;
}

}  // namespace slcmap::mapping
