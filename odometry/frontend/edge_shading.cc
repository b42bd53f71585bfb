#include "odometry/frontend/edge_shading.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slcmap {
namespace {

constexpr double kShadingMaxShift_px = 0.7;
constexpr size_t kMinProfiles = 4;

double At(const EdgeProfile& profile, int place) {
  return profile[static_cast<size_t>(place + kEdgeReach)];
}

// The slope on a side (-1 or 1), out of the reach of the blurred step. Where it changes there is
// another edge: then the smaller one.
double SlopeBeside(const EdgeProfile& profile, int side) {
  const double near = side * (At(profile, 3 * side) - At(profile, 2 * side));
  const double far = side * (At(profile, 4 * side) - At(profile, 3 * side));
  if (near * far <= 0) return 0;
  return std::abs(near) < std::abs(far) ? near : far;
}

// Between the slopes at some distance from the edge on both sides.
double SlopeDifference(const EdgeProfile& profile) {
  const double before = At(profile, -2) - At(profile, -4);
  const double behind = At(profile, 4) - At(profile, 2);
  return 0.5 * (behind - before);
}

}  // namespace

double ShadingShift_px(const std::vector<EdgeProfile>& profiles) {
  if (profiles.size() < kMinProfiles) return 0;
  const auto count = static_cast<double>(profiles.size());
  EdgeProfile mean{};
  double sum = 0, sum_squared = 0;
  for (const EdgeProfile& profile : profiles) {
    for (size_t i = 0; i < mean.size(); ++i) mean[i] += profile[i] / count;
    const double difference = SlopeDifference(profile);
    sum += difference;
    sum_squared += difference * difference;
  }
  const double before = SlopeBeside(mean, -1), behind = SlopeBeside(mean, 1);
  const double step = At(mean, 3) - At(mean, -3) - 3 * (before + behind);
  const double peak = 0.5 * (At(mean, 1) - At(mean, -1)) - 0.5 * (before + behind);
  if (step <= 0 || peak <= 0) return 0;
  // A step of h, blurred by sigma, rises by h / (sigma sqrt(2 pi)) at most.
  const double variance_px2 = step * step / (2 * std::numbers::pi * peak * peak);
  const double difference = behind - before;
  const double noise =
      (sum_squared - sum * sum / count) / (count * (count - 1));  // of the mean's, squared
  const double believed = std::max(0.0, 1 - noise / std::max(difference * difference, 1e-12));
  return std::clamp(believed * difference * variance_px2 / step, -kShadingMaxShift_px,
                    kShadingMaxShift_px);
}

}  // namespace slcmap
