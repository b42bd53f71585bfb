#include "mapping/views/pose_agreement.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/adjustment/patch_search.h"
#include "mapping/dense/stereo_depth.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMaxPairs = 40;
constexpr int kLaterViews = 5;  // that a partner is looked for among
constexpr double kMinTravel_m = 0.08, kMaxTravel_m = 1, kMaxTurn_rad = 0.4;
constexpr int kMaxCorners = 200;
constexpr double kCornerQuality = 0.01, kCornerDistance_px = 12;
constexpr double kSearched_px = 12;
constexpr double kNearer = 1.02;  // inverse depths, that tell the direction of an epipolar line
constexpr int kMinPoints = 15;    // of a pair that counts
constexpr double kSigmaOfMedian = 1.4826;  // of absolute values, of a normal distribution

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The first of the next views that looks at about the same from elsewhere.
std::optional<size_t> PartnerOf(const Views& views, size_t first) {
  const size_t end = std::min(views.size(), first + 1 + kLaterViews);
  for (size_t second = first + 1; second < end; ++second) {
    if (views[second].segment != views[first].segment) break;
    const RigidTransform between = views[first].T_world_imu.Inverse() * views[second].T_world_imu;
    const double travel_m = between.translation.norm();
    const double turn_rad = Eigen::AngleAxisd(between.rotation).angle();
    if (travel_m > kMinTravel_m && travel_m < kMaxTravel_m && turn_rad < kMaxTurn_rad) {
      return second;
    }
  }
  return std::nullopt;
}

// The surface around a pixel of the first view, as the second one sees it.
class ExpectedPlace {
 public:
  ExpectedPlace(const Camera& camera, const RigidTransform& T_second_first)
      : camera_(camera), T_second_first_(T_second_first) {}

  // Of what is at an inverse depth; nothing behind the second camera.
  std::optional<Vector2d> At(const Vector2d& px, double inverse_depth) const {
    const Vector3d p =
        T_second_first_ * (PinholeRay(camera_, px.x(), px.y()) / inverse_depth).eval();
    if (!(p.z() > 0.1) || !(inverse_depth > 0)) return std::nullopt;
    return Vector2d(camera_.fx_px * p.x() / p.z() + camera_.cx_px,
                    camera_.fy_px * p.y() / p.z() + camera_.cy_px);
  }

  std::optional<PatchWarp> WarpOf(const Vector2d& px, double inverse_depth,
                                  const DepthNode& node) const {
    const auto centre = At(px, inverse_depth);
    const auto right = At(px + Vector2d::UnitX(), inverse_depth + node.slope_x);
    const auto below = At(px + Vector2d::UnitY(), inverse_depth + node.slope_y);
    if (!centre || !right || !below) return std::nullopt;
    PatchWarp warp;
    warp.center_px = centre->cast<float>();
    warp.affine.col(0) = (*right - *centre).cast<float>();
    warp.affine.col(1) = (*below - *centre).cast<float>();
    return warp;
  }

 private:
  const Camera& camera_;
  const RigidTransform T_second_first_;
};

struct PairAgreement {
  std::vector<double> across_px;
  int searched = 0;
};

class PairMatcher {
 public:
  PairMatcher(const Views& views, const ViewImages& images) : views_(views), images_(images) {}

  PairAgreement Match(size_t first, size_t second) const {
    PairAgreement agreement;
    const StereoImage from = images_.Read(first), to = images_.Read(second);
    if (from.left.empty() || from.right.empty() || to.left.empty()) return agreement;
    const DepthGrid depth = StereoDepth(from, images_.mask(0), images_.rig(), DenseOptions());
    const ExpectedPlace expected(images_.rig().cameras[0],
                                 WorldFromCamera(views_[second], images_.rig()).Inverse() *
                                     WorldFromCamera(views_[first], images_.rig()));
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(from.left, corners, kMaxCorners, kCornerQuality, kCornerDistance_px,
                            images_.mask(0));
    for (const cv::Point2f& corner : corners) {
      Look(Vector2d(corner.x, corner.y), depth, expected, from.left, to.left, &agreement);
    }
    return agreement;
  }

 private:
  void Look(const Vector2d& px, const DepthGrid& depth, const ExpectedPlace& expected,
            const cv::Mat& from, const cv::Mat& to, PairAgreement* agreement) const {
    Vector2d offset_px;
    const DepthNode* node = depth.KnownNear(px, &offset_px);
    if (!node) return;
    const double inverse_depth =
        node->inverse_depth + Vector2d(node->slope_x, node->slope_y).dot(offset_px);
    const auto warp = expected.WarpOf(px, inverse_depth, *node);
    const auto nearer = expected.At(px, kNearer * inverse_depth);
    const auto centre = expected.At(px, inverse_depth);
    if (!warp || !nearer || !IsWithin(*centre, to)) return;
    ++agreement->searched;
    const auto places =
        SearchPatch(from, px.cast<float>(), to, *warp, kSearched_px, PatchSearchOptions());
    if (places.size() != 1) return;  // others look like it
    const Vector2d way = *nearer - *centre;
    if (way.norm() < 1e-3) return;
    const Vector2d across = Vector2d(-way.y(), way.x()).normalized();
    agreement->across_px.push_back(std::abs(across.dot(places[0].cast<double>() - *centre)));
  }

  // So far that all that is searched lies in the image.
  static bool IsWithin(const Vector2d& px, const cv::Mat& image) {
    constexpr double kBorder_px = kSearched_px + 10;
    return px.x() > kBorder_px && px.y() > kBorder_px && px.x() < image.cols - kBorder_px &&
           px.y() < image.rows - kBorder_px;
  }

  const Views& views_;
  const ViewImages& images_;
};

}  // namespace

std::optional<PoseAgreement> MeasurePoseAgreement(const Views& views, const ViewImages& images) {
  const PairMatcher matcher(views, images);
  const size_t step = std::max<size_t>(1, views.size() / kMaxPairs);
  std::vector<double> medians_px;
  int64_t searched = 0, found = 0;
  for (size_t first = 0; first < views.size(); first += step) {
    const auto second = PartnerOf(views, first);
    if (!second) continue;
    const PairAgreement pair = matcher.Match(first, *second);
    searched += pair.searched;
    found += std::ssize(pair.across_px);
    if (std::ssize(pair.across_px) >= kMinPoints) medians_px.push_back(Median(pair.across_px));
  }
  if (searched == 0) return std::nullopt;
  PoseAgreement agreement;
  agreement.pairs = static_cast<int>(medians_px.size());
  agreement.found = static_cast<double>(found) / static_cast<double>(searched);
  if (!medians_px.empty()) agreement.across_px = kSigmaOfMedian * Median(medians_px);
  return agreement;
}

}  // namespace slcmap
