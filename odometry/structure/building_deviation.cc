#include "odometry/structure/building_deviation.h"

#include <algorithm>
#include <cmath>

namespace slcmap::inline odometry {
namespace {

constexpr double kStartLines = 0.5;  // so many known lines weigh as much as the start
constexpr int kProbeEvery = 4;

constexpr size_t kMaxSamples = 1000;  // of the newest lines, two each
// Squared deviations count at most as those of one standard deviation: there are lines that follow
// no axis, and wrong matches. Of a normal distribution the mean is then:
constexpr double kMostSquared = 1, kMeanSquared = 0.5161;
constexpr double kMostOfStart =
    4;  // of its variance to that tried: else no line could make it small
// Of a line's posterior variance to the tie's; above it the observations tell nothing.
constexpr double kMaxTiedShare = 0.9;

// A slope has few lines: they may tell that they are far off, but not that they are exact.
BuildingDeviationOptions OfSlopes(BuildingDeviationOptions options) {
  options.start_sigma_rad = std::max(options.start_sigma_rad, options.min_sigma_rad);
  options.min_sigma_rad = options.start_sigma_rad;
  options.exact_below_rad = 0;
  options.shared_share = 0;
  return options;
}

}  // namespace

// A tie of variance t^2 pulls what a line does not share, e, to the axis turned by what it shares,
// c. What the line's own observations have of a component, y with variance r, says
//
//   1 / r = L_ee - 1 / t^2     y / r = L_ec c + L_ee e
//
// with the information L on (c, e) that is known with the tie.
std::vector<BuildingDeviation::Sample> BuildingDeviation::CollectSamples(
    const LineDeviation& line, double tie_sigma_rad) const {
  const Eigen::Vector2d own_rad = line.off_rad - line.shared_rad;
  // What the Cauchy loss leaves of the tie of a line that is far off.
  const double loss_rad2 = kDeviationLossSigma * kDeviationLossSigma;
  const double tie_rad2 = tie_sigma_rad * tie_sigma_rad + own_rad.squaredNorm() / loss_rad2;
  std::vector<Sample> samples;
  for (int i = 0; i < 2; ++i) {
    const double of_shared = line.shared_variance_rad2[i];
    const double both = line.cross_covariance_rad2[i] - of_shared;  // of c and e
    const double own = line.covariance_rad2(i, i) - of_shared - 2 * both;
    const double on_own = of_shared > 0 ? 1 / (own - both * both / of_shared) : 1 / own;
    const double told = on_own - 1 / tie_rad2;
    if (!(told > (1 - kMaxTiedShare) * on_own)) continue;
    const double on_both = of_shared > 0 ? -on_own * both / of_shared : 0;
    const double off_rad = (on_both * line.shared_rad[i] + on_own * own_rad[i]) / told;
    samples.push_back({off_rad * off_rad, 1 / told});
  }
  return samples;
}

void BuildingDeviation::Add(int64_t id, const LineDeviation& line, double tie_sigma_rad) {
  std::vector<Sample> samples = CollectSamples(line, tie_sigma_rad);
  if (!samples.empty()) open_[id] = std::move(samples);
}

void BuildingDeviation::Close(const std::unordered_set<int64_t>& ids) {
  std::erase_if(open_, [&](const auto& entry) {
    if (!ids.contains(entry.first)) return false;
    closed_.insert(closed_.end(), entry.second.begin(), entry.second.end());
    return true;
  });
  while (closed_.size() > kMaxSamples) closed_.pop_front();
}

bool BuildingDeviation::TakesAsExact(int64_t id) const {
  return IsTakenAsExact() && id % kProbeEvery != 0;
}

double BuildingDeviation::own_sigma_rad() const {
  return std::sqrt(1 - options_.shared_share) * sigma_rad_;
}

double BuildingDeviation::shared_sigma_rad() const {
  return IsTakenAsExact() ? options_.min_sigma_rad : std::sqrt(options_.shared_share) * sigma_rad_;
}

double BuildingDeviation::OfNewLine(int64_t id) const {
  return options_.start_sigma_rad == 0 || TakesAsExact(id) ? 0 : own_sigma_rad();
}

double BuildingDeviation::OfLine(int64_t id) const {
  return TakesAsExact(id) ? options_.min_sigma_rad : own_sigma_rad();
}

// By how much the samples scatter more than a standard deviation lets expect; falls with it.
double BuildingDeviation::Excess(double sigma_rad) const {
  const double sigma_rad2 = sigma_rad * sigma_rad;
  const double start_rad2 = options_.start_sigma_rad * options_.start_sigma_rad;
  double excess =
      2 * kStartLines * kMeanSquared * (std::min(start_rad2 / sigma_rad2, kMostOfStart) - 1);
  const auto add = [&](const Sample& sample) {
    const double known = start_rad2 / (start_rad2 + sample.variance_rad2);
    const double squared = sample.squared_rad2 / (sigma_rad2 + sample.variance_rad2);
    excess += known * known * (std::min(squared, kMostSquared) - kMeanSquared);
  };
  std::ranges::for_each(closed_, add);
  for (const auto& [id, samples] : open_) std::ranges::for_each(samples, add);
  return excess;
}

void BuildingDeviation::Solve() {
  double low = options_.min_sigma_rad, high = options_.max_sigma_rad;
  for (int i = 0; i < 30; ++i) {
    const double middle = std::sqrt(low * high);
    (Excess(middle) > 0 ? low : high) = middle;
  }
  sigma_rad_ = std::sqrt(low * high);
}

LineDeviations::LineDeviations(const BuildingDeviationOptions& options)
    : of_{BuildingDeviation(options), BuildingDeviation(OfSlopes(options))} {}

void LineDeviations::Close(const std::unordered_set<int64_t>& ids) {
  for (BuildingDeviation& deviation : of_) deviation.Close(ids);
}

void LineDeviations::Solve() {
  for (BuildingDeviation& deviation : of_) deviation.Solve();
}

}  // namespace slcmap::odometry
