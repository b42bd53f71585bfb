#include "mapping/views/view_matches.h"

#include <spdlog/spdlog.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "data/core/math.h"
#include "data/core/parallel.h"
#include "mapping/views/stereo_depth.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Matrix2f;
using Eigen::Vector2f;

constexpr int kMaxPlaces = 3;  // the best that are told
constexpr double kMinApart_px = 3;

constexpr int kSearchPatch_px = 15;
constexpr double kMinPatchCorrelation = 0.8;  // with where it is seen again
constexpr int kAlignIterations = 10;
constexpr float kMinStep_px = 0.02f;
constexpr float kMaxAligned_px = 2;  // from the pixel of best correlation

// The patch as it is expected to look, about its middle pixel; empty beyond the border.
cv::Mat Expected(const cv::Mat& from, const Vector2f& from_px, const Matrix2f& affine,
                 int patch_px) {
  const Matrix2f inverse = affine.inverse();
  const float reach = static_cast<float>(patch_px) * inverse.cwiseAbs().rowwise().sum().maxCoeff();
  if (from_px.minCoeff() < reach || from_px.x() > static_cast<float>(from.cols) - 1 - reach ||
      from_px.y() > static_cast<float>(from.rows) - 1 - reach) {
    return {};
  }
  const float middle = 0.5f * static_cast<float>(patch_px - 1);
  const Vector2f first = from_px - inverse * Vector2f(middle, middle);
  const cv::Matx23f map(inverse(0, 0), inverse(0, 1), first.x(), inverse(1, 0), inverse(1, 1),
                        first.y());
  cv::Mat patch;
  cv::warpAffine(from, patch, map, {patch_px, patch_px}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return patch;
}

// The best pixels of a map of correlations, each the only one near it.
std::vector<cv::Point> Peaks(cv::Mat correlations) {
  std::vector<cv::Point> peaks;
  while (std::ssize(peaks) < kMaxPlaces) {
    double best = 0;
    cv::Point at;
    cv::minMaxLoc(correlations, nullptr, &best, nullptr, &at);
    if (!(best >= kMinPatchCorrelation)) break;
    peaks.push_back(at);
    cv::circle(correlations, at, static_cast<int>(std::ceil(kMinApart_px)), -1, cv::FILLED);
  }
  return peaks;
}

}  // namespace

std::vector<Vector2f> SearchPatch(const cv::Mat& from, const Vector2f& from_px, const cv::Mat& to,
                                  const PatchWarp& warp, double within_px) {
  const cv::Mat expected = Expected(from, from_px, warp.affine, kSearchPatch_px);
  const int half = kSearchPatch_px / 2, reach = static_cast<int>(std::ceil(within_px)) + half;
  const cv::Point centre(static_cast<int>(std::lround(warp.center_px.x())),
                         static_cast<int>(std::lround(warp.center_px.y())));
  const cv::Rect region(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1);
  if (expected.empty() || (region & cv::Rect({}, to.size())) != region) return {};
  const PatchPattern pattern(kSearchPatch_px);
  Patch patch;
  if (!patch.Extract(pattern, from, from_px, false)) return {};
  cv::Mat correlations;
  cv::matchTemplate(to(region), expected, correlations, cv::TM_CCOEFF_NORMED);
  std::vector<Vector2f> places;
  for (const cv::Point& peak : Peaks(correlations)) {
    const Vector2f coarse(static_cast<float>(region.x + peak.x + half),
                          static_cast<float>(region.y + peak.y + half));
    PatchWarp aligned{coarse, warp.affine};
    const float correlation = patch.Align(pattern, to, kAlignIterations, kMinStep_px, &aligned);
    if (correlation < kMinPatchCorrelation) continue;
    if ((aligned.center_px - coarse).norm() > kMaxAligned_px) continue;
    places.push_back(aligned.center_px);
  }
  return places;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinTravel_m = 0.08, kMaxTravel_m = 1, kMaxTurn_rad = 0.4;
constexpr int kMaxCorners = 200;
constexpr double kCornerQuality = 0.01, kCornerDistance_px = 12;
constexpr double kSearched_px = 12;
constexpr double kMinDepth_m = 0.1;
constexpr double kNearer = 1.02;  // inverse depths, that tell the direction of an epipolar line

// The surface around a pixel of one view, as another one sees it.
class ExpectedPlace {
 public:
  ExpectedPlace(const Camera& camera, const RigidTransform& T_to_from)
      : camera_(camera), T_to_from_(T_to_from) {}

  // Of what is at an inverse depth; nothing behind the other camera.
  std::optional<Vector2d> At(const Vector2d& px, double inverse_depth) const {
    if (!(inverse_depth > 0)) return std::nullopt;
    const Vector3d p_from = PinholeRay(camera_, px.x(), px.y()) / inverse_depth;
    const Vector3d p = T_to_from_ * p_from;
    if (!(p.z() > kMinDepth_m)) return std::nullopt;
    return PixelFromPlane(camera_, Vector2d(p.hnormalized()));
  }

  std::optional<PatchWarp> ComputeWarp(const ViewPoint& point) const {
    const auto centre = At(point.px, point.inverse_depth);
    const auto right = At(point.px + Vector2d::UnitX(), point.inverse_depth + point.slope.x());
    const auto below = At(point.px + Vector2d::UnitY(), point.inverse_depth + point.slope.y());
    if (!centre || !right || !below) return std::nullopt;
    PatchWarp warp;
    warp.center_px = centre->cast<float>();
    warp.affine.col(0) = (*right - *centre).cast<float>();
    warp.affine.col(1) = (*below - *centre).cast<float>();
    return warp;
  }

 private:
  const Camera& camera_;
  const RigidTransform T_to_from_;
};

// So far inside that all that is searched lies in the image.
bool IsWithin(const Vector2d& px, const cv::Mat& image) {
  constexpr double kBorder_px = kSearched_px + 10;
  return px.x() > kBorder_px && px.y() > kBorder_px && px.x() < image.cols - kBorder_px &&
         px.y() < image.rows - kBorder_px;
}

}  // namespace

std::vector<ViewPoint> PointsOfView(const StereoImage& pair, const ViewImages& images) {
  if (pair.left.empty() || pair.right.empty()) return {};
  const DepthGrid depth = StereoDepth(pair, images.mask(0), images.rig(), DenseOptions());
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(pair.left, corners, kMaxCorners, kCornerQuality, kCornerDistance_px,
                          images.mask(0));
  std::vector<ViewPoint> points;
  for (const cv::Point2f& corner : corners) {
    const Vector2d px(corner.x, corner.y);
    Vector2d offset_px;
    const DepthNode* node = depth.KnownNear(px, &offset_px);
    if (!node) continue;
    const Vector2d slope(node->slope_x, node->slope_y);
    points.push_back({px, node->inverse_depth + slope.dot(offset_px), slope});
  }
  return points;
}

ViewMatches MatchPoints(const std::vector<ViewPoint>& points, const cv::Mat& from,
                        const cv::Mat& to, const Camera& camera, const RigidTransform& T_to_from) {
  ViewMatches matches;
  const ExpectedPlace expected(camera, T_to_from);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto warp = expected.ComputeWarp(points[i]);
    const auto centre = expected.At(points[i].px, points[i].inverse_depth);
    const auto nearer = expected.At(points[i].px, kNearer * points[i].inverse_depth);
    if (!warp || !centre || !nearer || !IsWithin(*centre, to)) continue;
    ++matches.searched;
    const auto places = SearchPatch(from, points[i].px.cast<float>(), to, *warp, kSearched_px);
    const Vector2d way = *nearer - *centre;
    if (places.size() != 1 || way.norm() < 1e-3) continue;
    const Vector2d across = Vector2d(-way.y(), way.x()).normalized();
    matches.found.push_back({i, places[0].cast<double>(), *centre, across});
  }
  return matches;
}

ViewsApart HowFarApart(const View& a, const View& b) {
  const RigidTransform T_a_b = a.T_world_imu.Inverse() * b.T_world_imu;
  return {T_a_b.translation.norm(), Eigen::AngleAxisd(T_a_b.rotation).angle()};
}

std::vector<size_t> FindPartners(const Views& views, size_t first, int later_views, size_t count) {
  std::vector<size_t> partners;
  const size_t end = std::min(views.size(), first + 1 + static_cast<size_t>(later_views));
  for (size_t second = first + 1; second < end && partners.size() < count; ++second) {
    if (views[second].segment != views[first].segment ||
        views[second].left_camera != views[first].left_camera) {
      break;
    }
    const auto [travel_m, turn_rad] = HowFarApart(views[first], views[second]);
    if (travel_m > kMinTravel_m && travel_m < kMaxTravel_m && turn_rad < kMaxTurn_rad) {
      partners.push_back(second);
    }
  }
  return partners;
}

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
  for (const ViewMatch& match :
       MatchPoints(points, pair.left, pair.right, rig.cameras[0], RightFromLeft(rig, 0)).found) {
    recognised.push_back(points[match.point]);
  }
  return recognised;
}

PairAgreement ComputeAgreement(const Views& views, const ViewImages& images, size_t first,
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
    if (views[first].left_camera != 0) break;  // one pair tells
    for (const size_t second : FindPartners(views, first, kLaterViews, 1)) {
      pairs.emplace_back(first, second);
    }
  }
  std::vector<PairAgreement> of_pairs(pairs.size());
  const auto measure = [&](size_t i) {
    of_pairs[i] = ComputeAgreement(views, images, pairs[i].first, pairs[i].second);
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

namespace {

constexpr double kMaxPoseError_px = 3, kMinPointsFound = 0.2;
constexpr size_t kLeastViewsOfRun = 10;  // one that hardly moved has few, which tell of no other

void WarnOfPoses(const std::string& found, bool are_given,
                 std::map<std::string, int64_t>* warnings) {
  ++(*warnings)[kPosesDisagree];
  spdlog::warn("{}; expected agreement to {} px, and at least {:.0f} % of points: are {}?", found,
               kMaxPoseError_px, 100 * kMinPointsFound,
               are_given ? "the poses those of the IMU, in metres, with the images' stamps"
                         : "the images those that the run was made of");
}

}  // namespace

std::optional<double> JudgePoses(const Views& views, const ViewImages& images, bool are_given,
                                 const Progress& progress,
                                 std::map<std::string, int64_t>* warnings) {
  const auto agreement = MeasurePoseAgreement(views, images, progress);
  if (!agreement) {
    if (views.size() >= (are_given ? 2 : kLeastViewsOfRun) && progress.Report(1)) {
      WarnOfPoses("no two views see points in common by their poses", are_given, warnings);
    }
    return std::nullopt;
  }
  const std::string found =
      agreement->across_px
          ? fmt::format(
                "poses and images agree to {:.2f} px in {} pairs of views, and {:.0f} % of "
                "points are where they are expected",
                *agreement->across_px, agreement->pairs, 100 * agreement->found)
          : fmt::format(
                "no two views show enough points to say how well poses and images agree: {:.0f} % "
                "are where they are expected",
                100 * agreement->found);
  spdlog::debug("{}", found);
  const bool are_doubtful =
      agreement->across_px.value_or(0) > kMaxPoseError_px || agreement->found < kMinPointsFound;
  if (are_doubtful) WarnOfPoses(found, are_given, warnings);
  return agreement->across_px;
}

}  // namespace slcmap::mapping
