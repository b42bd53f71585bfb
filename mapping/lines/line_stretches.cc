#include "mapping/lines/line_stretches.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "data/quantile.h"

namespace slcmap {
namespace {

constexpr double kStretchLength_m = 0.25;
constexpr int kStretchRounds = 4;
// A line that holds as a whole lends its certainty to its stretches.
constexpr double kStretchSlack = 1.5;
// What is left of a line that does not hold as a whole; without an axis.
constexpr double kMinPart_m = 0.25, kMinFreePart_m = 0.5;

int StretchAt(double along_m) { return static_cast<int>(std::floor(along_m / kStretchLength_m)); }

// The places of a line, by index, in stretches along it.
class Stretches {
 public:
  explicit Stretches(const std::vector<EdgePlace>& places) : places_(places) {
    for (size_t i = 0; i < places.size(); ++i) {
      members_[StretchAt(places[i].along_m)].push_back(i);
    }
  }

  // By how much the places of each stretch scatter about a fit, px.
  std::map<int, double> Spreads(const LineFit& fit, const ViewCameras& cameras) const {
    const std::vector<double> off_px = OffLine_px(fit.line, fit.shift_m, places_, cameras);
    std::map<int, double> spreads;
    for (const auto& [stretch, members] : members_) {
      std::vector<double> values;
      for (const size_t i : members) values.push_back(off_px[i]);
      spreads[stretch] = SpreadOf(std::move(values));
    }
    return spreads;
  }

  // The spread below which half of the places' stretches are.
  double HalfOf(const std::map<int, double>& spreads) const {
    std::vector<double> by_place;
    for (const auto& [stretch, members] : members_) {
      by_place.insert(by_place.end(), members.size(), spreads.at(stretch));
    }
    return Quantile(std::move(by_place), 0.5);
  }

  std::vector<EdgePlace> PlacesIn(const std::map<int, double>& spreads, double most_px) const {
    std::vector<EdgePlace> places;
    for (const EdgePlace& place : places_) {
      if (spreads.at(StretchAt(place.along_m)) <= most_px) places.push_back(place);
    }
    return places;
  }

 private:
  const std::vector<EdgePlace>& places_;
  std::map<int, std::vector<size_t>> members_;
};

// What is left of the intervals without the stretches that scatter more.
std::vector<Stretch> Without(const std::vector<Stretch>& intervals,
                             const std::map<int, double>& spreads, double most_px,
                             double min_length_m) {
  std::vector<Stretch> left = intervals;
  for (const auto& [stretch, spread_px] : spreads) {
    if (spread_px <= most_px) continue;
    const double from_m = stretch * kStretchLength_m, to_m = from_m + kStretchLength_m;
    std::vector<Stretch> cut;
    for (const Stretch& interval : left) {
      if (interval.to_m <= from_m || interval.from_m >= to_m) {
        cut.push_back(interval);
        continue;
      }
      if (interval.from_m < from_m) cut.push_back({interval.from_m, from_m});
      if (interval.to_m > to_m) cut.push_back({to_m, interval.to_m});
    }
    left = std::move(cut);
  }
  std::erase_if(left, [&](const Stretch& interval) { return interval.length_m() < min_length_m; });
  return left;
}

// The fit to those stretches that agree with each other, found by leaving out, again and again, the
// half that scatters most.
std::optional<LineFit> FitToBest(const Stretches& stretches, const LineFit& whole,
                                 const TrackedLine& line, const ViewCameras& cameras,
                                 const std::optional<DirectionPrior>& prior,
                                 const LineFitOptions& options, double max_spread_px) {
  std::optional<LineFit> fit = whole;
  for (int round = 0; fit && round < kStretchRounds && fit->spread_px > max_spread_px; ++round) {
    const std::map<int, double> spreads = stretches.Spreads(*fit, cameras);
    fit = FitLine(line.line, stretches.PlacesIn(spreads, stretches.HalfOf(spreads)), cameras, prior,
                  options);
  }
  return fit;
}

}  // namespace

bool StretchLimits::Hold(const LineFit& fit) const {
  return fit.views >= min_views && fit.sigma_m() <= max_sigma_m && fit.spread_px <= max_spread_px;
}

void DropPlacesOutside(TrackedLine* line) {
  std::erase_if(line->places, [&](const EdgePlace& place) {
    return std::none_of(line->intervals.begin(), line->intervals.end(),
                        [&](const Stretch& interval) {
                          return place.along_m >= interval.from_m && place.along_m <= interval.to_m;
                        });
  });
}

std::optional<LineFit> FitStretches(const ViewCameras& cameras,
                                    const std::optional<DirectionPrior>& prior,
                                    const LineFitOptions& options, const StretchLimits& limits,
                                    TrackedLine* line) {
  const auto whole = FitLine(line->line, line->places, cameras, prior, options);
  if (!whole) return whole;
  const Stretches stretches(line->places);
  const auto best =
      FitToBest(stretches, *whole, *line, cameras, prior, options, limits.max_spread_px);
  if (!best) return whole;
  const std::map<int, double> spreads = stretches.Spreads(*best, cameras);
  const bool holds = limits.Hold(*whole);
  const double most_px = (holds ? kStretchSlack : 1) * limits.max_spread_px;
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

}  // namespace slcmap
