#include "mapping/views/pose_agreement.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/quantile.h"
#include "mapping/views/view_matches.h"

namespace slcmap {
namespace {

constexpr size_t kMaxPairs = 40;
constexpr int kLaterViews = 5;  // that a partner is looked for among
constexpr int kMinPoints = 15;  // of a pair that counts

}  // namespace

std::optional<PoseAgreement> MeasurePoseAgreement(const Views& views, const ViewImages& images,
                                                  const Progress& progress) {
  const size_t step = std::max<size_t>(1, (views.size() + kMaxPairs - 1) / kMaxPairs);
  std::vector<double> medians_px;
  int64_t searched = 0, found = 0;
  for (size_t first = 0; first < views.size(); first += step) {
    if (!progress.Report(static_cast<double>(first) / static_cast<double>(views.size()))) {
      return std::nullopt;
    }
    for (const size_t second : PartnersOf(views, first, kLaterViews, 1)) {
      const StereoImage from = images.Read(first), to = images.Read(second);
      if (to.left.empty()) continue;
      const RigidTransform T_to_from = WorldFromCamera(views[second], images.rig()).Inverse() *
                                       WorldFromCamera(views[first], images.rig());
      const ViewMatches matches = MatchPoints(PointsOfView(from, images), from.left, to.left,
                                              images.rig().cameras[0], T_to_from);
      searched += matches.searched;
      found += std::ssize(matches.found);
      if (std::ssize(matches.found) < kMinPoints) continue;
      std::vector<double> across_px;
      for (const ViewMatch& match : matches.found) {
        across_px.push_back(std::abs(match.across.dot(match.px - match.expected_px)));
      }
      medians_px.push_back(Quantile(std::move(across_px), 0.5));
    }
  }
  if (searched == 0) return std::nullopt;
  PoseAgreement agreement;
  agreement.pairs = static_cast<int>(medians_px.size());
  agreement.found = static_cast<double>(found) / static_cast<double>(searched);
  if (!medians_px.empty()) agreement.across_px = kSigmaOfMedian * Quantile(medians_px, 0.5);
  return agreement;
}

}  // namespace slcmap
