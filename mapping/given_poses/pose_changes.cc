#include "mapping/given_poses/pose_changes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "data/angle_unit.h"
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

bool IsOff(const StepPair& pair, double scale, const StepOff& usual) {
  constexpr double kLeast_rad = 0.015, kLeast_m = 0.04, kSigmas = 5, kTimes = 3;
  constexpr double kTurnShare = 0.03, kWayShare = 0.1;
  const StepOff off = OffStep(pair, scale);
  const double turned_rad = LogRotation(pair.known.T_from_to.rotation).norm(),
               moved_m = pair.known.T_from_to.translation.norm();
  return off.turn_rad > kLeast_rad + kSigmas * pair.known.turn_sigma_rad + kTimes * usual.turn_rad +
                            kTurnShare * turned_rad ||
         off.way_m > kLeast_m + kSigmas * pair.known.way_sigma_m + kTimes * usual.way_m +
                         kWayShare * moved_m;
}

// The longest of several steps on end that are off.
std::string WordsOfStretch(const std::vector<StepPair>& pairs, double scale, const StepOff& usual,
                           const std::string& who) {
  constexpr size_t kLeastOff = 3;
  size_t longest = 0, end = 0, here = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    here = IsOff(pairs[i], scale, usual) ? here + 1 : 0;
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
      kDegreesPerRadian * most.turn_rad, most.way_m, longest, who,
      kDegreesPerRadian * usual.turn_rad, usual.way_m);
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
  const Eigen::Vector3d turned = kDegreesPerRadian * span_s * rate_rad_s;
  return fmt::format(
      "they drift by {:.1f} degrees over {:.1f} s (about x, y, z of their world by {:.1f}, {:.1f}, "
      "{:.1f})",
      turned.norm(), span_s, turned.x(), turned.y(), turned.z());
}

// Of both sides of where they differ most.
std::string WordsOfScales(const std::vector<StepPair>& pairs, double scale) {
  constexpr double kLeast = 0.06, kSigmas = 5;  // images alone have 0.035 in EuRoC MH_01
  double most = kSigmas;
  std::string words;
  for (auto at = pairs.begin() + kLeastSteps; at + kLeastSteps <= pairs.end(); ++at) {
    std::array<double, 2> sigmas{};
    const double first = ScaleOf({pairs.begin(), at}, sigmas.data()),
                 second = ScaleOf({at, pairs.end()}, &sigmas[1]);
    const double change = std::abs(second - first) / scale;
    const double in_sigmas = change * scale / std::hypot(sigmas[0], sigmas[1]);
    if (!(change > kLeast && in_sigmas > most && first > 0 && second > 0)) continue;
    most = in_sigmas;
    words = fmt::format(
        "their scale changes: lengths are {:.3f} times what they should be before {:.3f} s, {:.3f} "
        "times from there",
        scale / first, ToSeconds(at->known.from_ns), scale / second);
  }
  return words;
}

}  // namespace

std::string WordsOfChange(std::vector<StepPair> pairs, double scale, const std::string& who) {
  constexpr double kKnown_rad = 0.01, kKnown_m = 0.03;
  constexpr ptrdiff_t kLeastPairs = 2 * kLeastSteps;
  std::erase_if(pairs, [](const StepPair& pair) {
    return pair.known.turn_sigma_rad > kKnown_rad || pair.known.way_sigma_m > kKnown_m;
  });
  if (std::ssize(pairs) < kLeastPairs) return "";
  const PoseOff medians = OffOf(pairs, scale);
  const StepOff usual{medians.turn_rad, medians.way_m};
  std::vector<std::string> words = {WordsOfStretch(pairs, scale, usual, who)};
  std::erase_if(pairs, [&](const StepPair& pair) { return IsOff(pair, scale, usual); });
  if (std::ssize(pairs) >= kLeastPairs) {
    words.push_back(WordsOfScales(pairs, scale));
    words.push_back(WordsOfDrift(pairs));
  }
  std::erase(words, "");
  return fmt::format("{}", fmt::join(words, "; "));
}

}  // namespace slcmap
