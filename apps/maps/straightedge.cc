#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "apps/maps/map_straightness.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

constexpr int kPlaces = 8;           // of a straightedge, that gaps are told at
constexpr double kShortest = 0.9;    // a wall may be so much shorter than what is laid on it
constexpr double kKnownBelow = 0.7;  // of the places beneath a straightedge
constexpr double kLeastSpan = 0.9;   // of a straightedge, between the outer places under it
// The range of nine normal values about the line that fits them, in standard deviations.
constexpr double kNoiseRange = 2.3;
constexpr double kSlides = 4;  // a straightedge is laid so often on its own length

// Sums over the samples beneath a straightedge, for a plane of least squares.
struct PlaneSums {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Eigen::Vector3d with_off = Eigen::Vector3d::Zero();
  double off_squares = 0, weights = 0, weight_squares = 0;

  void Add(const StraightSample& s, double middle_m) {
    const Eigen::Vector3d row(1, s.along_m - middle_m, s.up_m);
    products += s.weight * row * row.transpose();
    with_off += s.weight * s.off_m * row;
    off_squares += s.weight * s.off_m * s.off_m;
    weights += s.weight;
    weight_squares += s.weight * s.weight;
  }

  // Mean square off the best plane, as if of endless samples; nothing of too few.
  std::optional<double> Variance_m2() const {
    const double count = weights * weights / weight_squares;
    if (!(count > 6)) return std::nullopt;
    const Eigen::Matrix3d held = products + 1e-9 * weights * Eigen::Matrix3d::Identity();
    const double left = off_squares - with_off.dot(held.ldlt().solve(with_off));
    return std::max(0.0, left) / weights * count / (count - 3);
  }
};

using Samples = std::vector<StraightSample>;

// How far a wall or an edge is off its plane or line, at one place along it.
struct ProfilePlace {
  double along_m = 0, off_m = 0;
};

struct SpreadPlaces {
  std::vector<ProfilePlace> profile;
  double noise_m = 0;  // of a place, the median
};

// Places step_m apart, each the mean of what is around it.
SpreadPlaces MeanPlaces(const Samples& samples, double step_m, double noise_m) {
  struct Sums {
    double weights = 0, squares = 0, along = 0, off = 0;
  };
  std::map<int64_t, Sums> sums;
  for (const StraightSample& s : samples) {
    Sums& sum = sums[std::lround((s.along_m - samples.front().along_m) / step_m)];
    sum.weights += s.weight;
    sum.squares += s.weight * s.weight;
    sum.along += s.weight * s.along_m;
    sum.off += s.weight * s.off_m;
  }
  SpreadPlaces places;
  std::vector<double> noises_m;
  for (const auto& [place, sum] : sums) {
    places.profile.push_back({sum.along / sum.weights, sum.off / sum.weights});
    noises_m.push_back(noise_m * std::sqrt(sum.squares) / sum.weights);
  }
  if (!noises_m.empty()) places.noise_m = Quantile(noises_m, 0.5);
  return places;
}

// The corners of the upper side (sign 1) or lower side (-1) of the hull of places in their order.
std::vector<Eigen::Vector2d> HullSide(const std::vector<Eigen::Vector2d>& places, double sign) {
  std::vector<Eigen::Vector2d> hull;
  for (const Eigen::Vector2d& p : places) {
    while (hull.size() >= 2) {
      const Eigen::Vector2d a = hull[hull.size() - 1] - hull[hull.size() - 2], b = p - hull.back();
      if (sign * (a.x() * b.y() - a.y() * b.x()) < 0) break;
      hull.pop_back();
    }
    hull.push_back(p);
  }
  return hull;
}

// The least distance, along y, of two parallels that hold the places: one lies on an edge of the
// hull.
double LeastZone(const std::vector<Eigen::Vector2d>& places) {
  double least = HUGE_VAL;
  for (const double sign : {1.0, -1.0}) {
    const std::vector<Eigen::Vector2d> hull = HullSide(places, sign);
    for (size_t i = 0; i + 1 < hull.size(); ++i) {
      const double slope = (hull[i + 1].y() - hull[i].y()) / (hull[i + 1].x() - hull[i].x());
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (const Eigen::Vector2d& p : places) {
        low = std::min(low, p.y() - slope * p.x());
        high = std::max(high, p.y() - slope * p.x());
      }
      least = std::min(least, high - low);
    }
  }
  return least;
}

// The largest gap of a straightedge anywhere along a profile that is sorted by along_m; nothing
// where it is longer than the profile, or too few of the places beneath it are known.
std::optional<double> GapUnder_m(const std::vector<ProfilePlace>& profile, double length_m,
                                 double step_m) {
  std::optional<double> largest;
  for (size_t first = 0; first < profile.size(); ++first) {
    std::vector<Eigen::Vector2d> places;
    for (size_t i = first; i < profile.size(); ++i) {
      if (profile[i].along_m > profile[first].along_m + length_m + 0.5 * step_m) break;
      places.emplace_back(profile[i].along_m, profile[i].off_m);
    }
    if (places.size() < 3) continue;
    const double span_m = places.back().x() - places.front().x();
    const double known = static_cast<double>(places.size()) / (length_m / step_m);
    if (span_m < kLeastSpan * length_m || known < kKnownBelow) continue;
    largest = std::max(largest.value_or(0), LeastZone(places));
  }
  return largest;
}

double WithoutNoise_m(double gap_m, double noise_m) {
  const double of_noise_m = kNoiseRange * noise_m;
  return std::sqrt(std::max(0.0, gap_m * gap_m - of_noise_m * of_noise_m));
}

// Whether most places beneath a straightedge are known.
bool IsKnownBelow(Samples::const_iterator from, Samples::const_iterator to, double start_m,
                  double length_m) {
  bool known[kPlaces] = {};
  for (auto s = from; s != to; ++s) {
    const int place = static_cast<int>((s->along_m - start_m) / length_m * kPlaces);
    known[std::clamp(place, 0, kPlaces - 1)] = true;
  }
  return static_cast<double>(std::count(known, known + kPlaces, true)) >= kKnownBelow * kPlaces;
}

std::optional<LaidStraightedge> Lay(const Samples& sorted, double length_m, double noise_m) {
  const double first_m = sorted.front().along_m, whole_m = sorted.back().along_m - first_m;
  if (whole_m < kShortest * length_m) return std::nullopt;
  const double spare_m = std::max(0.0, whole_m - length_m);
  const int slides = 1 + static_cast<int>(std::ceil(spare_m / length_m * kSlides));
  double squares = 0;
  int laid = 0;
  for (int i = 0; i < slides; ++i) {
    const double start_m = first_m + (slides > 1 ? spare_m * i / (slides - 1) : 0);
    const auto before = [](const StraightSample& s, double along_m) { return s.along_m < along_m; };
    const auto from = std::lower_bound(sorted.begin(), sorted.end(), start_m, before);
    const auto to = std::lower_bound(from, sorted.end(), start_m + length_m, before);
    if (!IsKnownBelow(from, to, start_m, std::min(length_m, whole_m))) continue;
    PlaneSums sums;
    for (auto s = from; s != to; ++s) sums.Add(*s, start_m + 0.5 * length_m);
    const auto variance_m2 = sums.Variance_m2();
    if (!variance_m2) continue;
    squares += *variance_m2;
    ++laid;
  }
  if (laid == 0) return std::nullopt;
  const double step_m = std::min(length_m, whole_m) / kPlaces;
  const SpreadPlaces places = MeanPlaces(sorted, step_m, noise_m);
  const double gap_m = GapUnder_m(places.profile, std::min(length_m, whole_m), step_m).value_or(0);
  return LaidStraightedge{length_m, whole_m, std::sqrt(squares / laid),
                          WithoutNoise_m(gap_m, places.noise_m)};
}

void SortAlong(Samples* samples) {
  std::sort(samples->begin(), samples->end(), [](const auto& a, const auto& b) {
    return std::tie(a.along_m, a.up_m, a.off_m) < std::tie(b.along_m, b.up_m, b.off_m);
  });
}

}  // namespace

double AllowedGap_m(double length_m) {
  // Lengths [m], and what is allowed there [mm].
  constexpr std::array<std::pair<double, double>, 5> kAllowed = {
      {{0.1, 3}, {1, 5}, {4, 10}, {10, 20}, {15, 25}}};
  if (length_m <= kAllowed.front().first) return 1e-3 * kAllowed.front().second;
  for (size_t i = 1; i < kAllowed.size(); ++i) {
    const auto& [from_m, from_mm] = kAllowed[i - 1];
    const auto& [to_m, to_mm] = kAllowed[i];
    if (length_m > to_m) continue;
    return 1e-3 * (from_mm + (to_mm - from_mm) * (length_m - from_m) / (to_m - from_m));
  }
  return 1e-3 * kAllowed.back().second;
}

std::vector<LaidStraightedge> LayStraightedges(Samples samples, double noise_m) {
  std::vector<LaidStraightedge> laid;
  if (samples.size() < 3) return laid;
  SortAlong(&samples);
  for (const double length_m : kMapStraightedges_m) {
    if (const auto one = Lay(samples, length_m, noise_m)) laid.push_back(*one);
  }
  return laid;
}

double RobustNoise_m(const Samples& samples, double step_m) {
  if (samples.empty()) return 0;
  Samples sorted = samples;
  SortAlong(&sorted);
  const std::vector<ProfilePlace> profile = MeanPlaces(sorted, step_m, 0).profile;
  std::vector<std::pair<double, double>> off;  // with its weight
  double weights = 0;
  size_t place = 0;
  for (const StraightSample& s : sorted) {
    while (place + 1 < profile.size() && std::abs(profile[place + 1].along_m - s.along_m) <
                                             std::abs(profile[place].along_m - s.along_m)) {
      ++place;
    }
    off.emplace_back(std::abs(s.off_m - profile[place].off_m), s.weight);
    weights += s.weight;
  }
  std::sort(off.begin(), off.end());
  double sum = 0;
  for (const auto& [distance_m, weight] : off) {
    sum += weight;
    if (sum >= 0.5 * weights) return kSigmaOfMedian * distance_m;
  }
  return 0;
}

double WholeGap_m(Samples samples, double noise_m) {
  if (samples.size() < 3) return 0;
  SortAlong(&samples);
  const double whole_m = samples.back().along_m - samples.front().along_m;
  if (!(whole_m > 0)) return 0;
  const SpreadPlaces places = MeanPlaces(samples, whole_m / kPlaces, noise_m);
  return WithoutNoise_m(GapUnder_m(places.profile, whole_m, whole_m / kPlaces).value_or(0),
                        places.noise_m);
}

}  // namespace slcmap::evaluation
