#include "odometry/frontend/line_follower.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "odometry/frontend/line_geometry.h"
#include "odometry/frontend/line_refinement.h"
#include "odometry/frontend/line_strip.h"

namespace slcmap {
namespace {

constexpr double kMaxExtension_px = 60;
constexpr double kTiltLoss = 0.15;  // of correlation, while the tilt is not found
constexpr double kMinLead = 0.05;   // of the best place before another
constexpr int kOtherPlace_px = 3;   // that is another place

// The shift across, in whole pixels, at which the profile is found.
std::optional<int> FindShift(const cv::Mat& image, const LineSegment& expected,
                             const Eigen::VectorXf& profile, int gate_px, double min_correlation) {
  const Eigen::VectorXf wide = MeanProfile(image, expected, kProfileReach_px + gate_px);
  std::vector<double> correlations;
  for (int i = 0; i <= 2 * gate_px; ++i) {
    correlations.push_back(ProfileCorrelation(profile, wide.segment(i, profile.size())));
  }
  const auto best = std::max_element(correlations.begin(), correlations.end());
  if (*best < min_correlation) return std::nullopt;
  for (auto it = correlations.begin(); it != correlations.end(); ++it) {
    if (std::abs(it - best) >= kOtherPlace_px && *it > *best - kMinLead) return std::nullopt;
  }
  return static_cast<int>(best - correlations.begin()) - gate_px;
}

}  // namespace

std::optional<LineSegment> FollowEdge(const cv::Mat& image, const LineSegment& expected,
                                      const Eigen::VectorXf& profile, double gate_px,
                                      double min_correlation) {
  const auto shift = FindShift(image, expected, profile, static_cast<int>(std::ceil(gate_px)),
                               min_correlation - kTiltLoss);
  if (!shift) return std::nullopt;
  const Eigen::Vector2d offset = *shift * Normal(expected);
  LineRefinementOptions options;
  options.max_extension_px = kMaxExtension_px;
  const auto refined =
      RefineSegment(image, {expected.start + offset, expected.end + offset}, options);
  if (!refined) return std::nullopt;
  const Eigen::VectorXf found = MeanProfile(image, refined->segment);
  if (ProfileCorrelation(profile, found) < min_correlation) return std::nullopt;
  return refined->segment;
}

}  // namespace slcmap
