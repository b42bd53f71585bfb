#include "mapping/given_poses/pose_changes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/quantile.h"

namespace slcmap {
namespace {

struct StepOff {
  double turn_rad = 0, way_m = 0;
};

StepOff OffStep(const StepPair& pair, double scale) {
  return {pair.known.T_from_to.rotation.angularDistance(pair.posed.rotation),
          (pair.known.T_from_to.translation - scale * pair.posed.translation).norm()};
}

bool IsOff(const StepPair& pair, const StepOff& off, const StepOff& usual) {
  constexpr double kLeast_rad = 0.02, kLeast_m = 0.05, kSigmas = 5, kTimes = 5, kShare = 0.1;
  const double turned_rad = LogRotation(pair.known.T_from_to.rotation).norm(),
               moved_m = pair.known.T_from_to.translation.norm();
  return off.turn_rad > kLeast_rad + kSigmas * pair.known.turn_sigma_rad + kTimes * usual.turn_rad +
                            kShare * turned_rad ||
         off.way_m >
             kLeast_m + kSigmas * pair.known.way_sigma_m + kTimes * usual.way_m + kShare * moved_m;
}

// The longest of several steps on end that are off.
std::string WordsOfStretch(const std::vector<StepPair>& pairs, double scale,
                           const std::string& who) {
  constexpr size_t kLeastOff = 3;
  const PoseOff medians = OffOf(pairs, scale);
  const StepOff usual{medians.turn_rad, medians.way_m};
  size_t longest = 0, end = 0, here = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    here = IsOff(pairs[i], OffStep(pairs[i], scale), usual) ? here + 1 : 0;
    if (here > longest) longest = here, end = i + 1;
  }
  if (longest < kLeastOff) return "";
  StepOff most;
  for (size_t i = end - longest; i < end; ++i) {
    const StepOff off = OffStep(pairs[i], scale);
    most = {std::max(most.turn_rad, off.turn_rad), std::max(most.way_m, off.way_m)};
  }
  return fmt::format(
      "from {:.3f} to {:.3f} s the poses are off by up to {:.1f} degrees and {:.3f} m (by {} {}; "
      "in the median of all by {:.1f} degrees and {:.3f} m)",
      ToSeconds(pairs[end - longest].known.from_ns), ToSeconds(pairs[end - 1].known.to_ns),
      Degrees(most.turn_rad), most.way_m, longest, who, Degrees(usual.turn_rad), usual.way_m);
}

// By the turns that poses make more than the steps, about axes of their world.
std::string WordsOfDrift(const std::vector<StepPair>& pairs) {
  constexpr double kLeast_rad = 3 * M_PI / 180, kSigmas = 6;
  std::array<std::vector<double>, 3> rates_rad_s;
  for (const StepPair& pair : pairs) {
    const Eigen::Vector3d more_rad =
        pair.R_world_to *
        LogRotation(pair.known.T_from_to.rotation.conjugate() * pair.posed.rotation);
    const double apart_s = ToSeconds(pair.known.to_ns - pair.known.from_ns);
    for (int i = 0; i < 3; ++i) rates_rad_s[i].push_back(more_rad[i] / apart_s);
  }
  Eigen::Vector3d rate_rad_s, sigma_rad_s;
  for (int i = 0; i < 3; ++i) {
    const double spread = 0.74 * (Quantile(rates_rad_s[i], 0.75) - Quantile(rates_rad_s[i], 0.25));
    rate_rad_s[i] = Quantile(rates_rad_s[i], 0.5);
    sigma_rad_s[i] = 1.25 * spread / std::sqrt(static_cast<double>(pairs.size()));
  }
  const double span_s = ToSeconds(pairs.back().known.to_ns - pairs.front().known.from_ns);
  if (rate_rad_s.norm() * span_s < kLeast_rad || rate_rad_s.norm() < kSigmas * sigma_rad_s.norm()) {
    return "";
  }
  const Eigen::Vector3d turned = Degrees(span_s) * rate_rad_s;
  return fmt::format(
      "they drift by {:.1f} degrees over {:.1f} s (about x, y, z of their world by {:.1f}, {:.1f}, "
      "{:.1f})",
      turned.norm(), span_s, turned.x(), turned.y(), turned.z());
}

std::string WordsOfScales(const std::vector<StepPair>& pairs, double scale) {
  constexpr double kLeast = 0.04, kSigmas = 5;
  const auto middle = pairs.begin() + std::ssize(pairs) / 2;
  std::array<double, 2> sigmas{};
  const double first = ScaleOf({pairs.begin(), middle}, sigmas.data()),
               second = ScaleOf({middle, pairs.end()}, &sigmas[1]);
  const double change = std::abs(second / first - 1);
  const double sigma = std::hypot(sigmas[0], sigmas[1]) / scale;
  if (!(change > std::max(kLeast, kSigmas * sigma))) return "";
  return fmt::format(
      "their scale changes: lengths are {:.3f} times what they should be in the first half, {:.3f} "
      "times in the second",
      scale / first, scale / second);
}

}  // namespace

std::string WordsOfChange(std::vector<StepPair> pairs, double scale, const std::string& who) {
  constexpr double kKnown_rad = 0.01, kKnown_m = 0.03;
  constexpr ptrdiff_t kLeastPairs = 2 * kLeastSteps;
  std::erase_if(pairs, [](const StepPair& pair) {
    return pair.known.turn_sigma_rad > kKnown_rad || pair.known.way_sigma_m > kKnown_m;
  });
  if (std::ssize(pairs) < kLeastPairs) return "";
  std::string words;
  for (const std::string& found :
       {WordsOfScales(pairs, scale), WordsOfDrift(pairs), WordsOfStretch(pairs, scale, who)}) {
    if (!found.empty()) words += (words.empty() ? "" : "; ") + found;
  }
  return words;
}

}  // namespace slcmap
