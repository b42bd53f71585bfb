#include "mapping/views/pose_agreement.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "data/quantile.h"
#include "mapping/views/view_matches.h"
#include "mapping/watched_loop.h"

namespace slcmap {
namespace {

constexpr size_t kMaxPairs = 40;
constexpr int kLaterViews = 5;  // that a partner is looked for among
constexpr int kMinPoints = 15;  // of a pair that counts

// What the points of one view are in another.
struct PairAgreement {
  int64_t searched = 0, found = 0;
  double across_px = 0;  // median
};

PairAgreement AgreementOf(const Views& views, const ViewImages& images, size_t first,
                          size_t second) {
  const StereoImage from = images.Read(first), to = images.Read(second);
  if (to.left.empty()) return {};
  const RigidTransform T_to_from = WorldFromCamera(views[second], images.rig()).Inverse() *
                                   WorldFromCamera(views[first], images.rig());
  const ViewMatches matches = MatchPoints(PointsOfView(from, images), from.left, to.left,
                                          images.rig().cameras[0], T_to_from);
  std::vector<double> across_px;
  for (const ViewMatch& match : matches.found) {
    across_px.push_back(std::abs(match.across.dot(match.px - match.expected_px)));
  }
  PairAgreement agreement{matches.searched, std::ssize(matches.found)};
  if (!across_px.empty()) agreement.across_px = Quantile(std::move(across_px), 0.5);
  return agreement;
}

}  // namespace

std::optional<PoseAgreement> MeasurePoseAgreement(const Views& views, const ViewImages& images,
                                                  const Progress& progress) {
  constexpr size_t kAtOnce = 4;  // pairs in memory
  const size_t step = std::max<size_t>(1, (views.size() + kMaxPairs - 1) / kMaxPairs);
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t first = 0; first < views.size(); first += step) {
    for (const size_t second : PartnersOf(views, first, kLaterViews, 1)) {
      pairs.emplace_back(first, second);
    }
  }
  std::vector<PairAgreement> of_pairs(pairs.size());
  const auto measure = [&](size_t i) {
    of_pairs[i] = AgreementOf(views, images, pairs[i].first, pairs[i].second);
  };
  if (!ForEachWatched(pairs.size(), progress, measure, kAtOnce)) return std::nullopt;
  std::vector<double> medians_px;
  int64_t searched = 0, found = 0;
  for (const PairAgreement& pair : of_pairs) {
    searched += pair.searched;
    found += pair.found;
    if (pair.found >= kMinPoints) medians_px.push_back(pair.across_px);
  }
  if (searched == 0) return std::nullopt;
  PoseAgreement agreement;
  agreement.pairs = static_cast<int>(medians_px.size());
  agreement.found = static_cast<double>(found) / static_cast<double>(searched);
  if (!medians_px.empty()) agreement.across_px = kSigmaOfMedian * Quantile(medians_px, 0.5);
  return agreement;
}

}  // namespace slcmap
