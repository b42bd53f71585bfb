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
  int64_t points = 0, searched = 0, found = 0;  // searched: those that the other should show
  double across_px = 0;                         // median
};

// Points of a view that its own right image shows, too: others are of noise, or look like places
// beside them, and would not be found by the best of poses.
std::vector<ViewPoint> RecognisedPoints(const StereoImage& pair, const ViewImages& images) {
  const Rig& rig = images.rig();
  const std::vector<ViewPoint> points = PointsOfView(pair, images);
  std::vector<ViewPoint> recognised;
  for (const ViewMatch& match : MatchPoints(points, pair.left, pair.right, rig.cameras[0],
                                            rig.T_imu_camera[1].Inverse() * rig.T_imu_camera[0])
                                    .found) {
    recognised.push_back(points[match.point]);
  }
  return recognised;
}

PairAgreement AgreementOf(const Views& views, const ViewImages& images, size_t first,
                          size_t second) {
  const StereoImage from = images.Read(first), to = images.Read(second);
  if (to.left.empty()) return {};
  const RigidTransform T_to_from = WorldFromCamera(views[second], images.rig()).Inverse() *
                                   WorldFromCamera(views[first], images.rig());
  const std::vector<ViewPoint> points = RecognisedPoints(from, images);
  const ViewMatches matches =
      MatchPoints(points, from.left, to.left, images.rig().cameras[0], T_to_from);
  std::vector<double> across_px;
  for (const ViewMatch& match : matches.found) {
    across_px.push_back(std::abs(match.across.dot(match.px - match.expected_px)));
  }
  PairAgreement agreement{std::ssize(points), matches.searched, std::ssize(matches.found)};
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
  int64_t points = 0, searched = 0, found = 0;
  for (const PairAgreement& pair : of_pairs) {
    points += pair.points;
    searched += pair.searched;
    found += pair.found;
    if (pair.found >= kMinPoints) medians_px.push_back(pair.across_px);
  }
  PoseAgreement agreement;
  if (!pairs.empty() && points == 0) return agreement;
  if (searched == 0) return std::nullopt;
  agreement.pairs = static_cast<int>(medians_px.size());
  agreement.found = static_cast<double>(found) / static_cast<double>(searched);
  if (!medians_px.empty()) agreement.across_px = kSigmaOfMedian * Quantile(medians_px, 0.5);
  return agreement;
}

}  // namespace slcmap
