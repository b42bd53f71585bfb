#include "mapping/views/view_matches.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "mapping/adjustment/patch_search.h"
#include "mapping/dense/stereo_depth.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
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

  std::optional<PatchWarp> WarpOf(const ViewPoint& point) const {
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
    const auto warp = expected.WarpOf(points[i]);
    const auto centre = expected.At(points[i].px, points[i].inverse_depth);
    const auto nearer = expected.At(points[i].px, kNearer * points[i].inverse_depth);
    if (!warp || !centre || !nearer || !IsWithin(*centre, to)) continue;
    ++matches.searched;
    const auto places = SearchPatch(from, points[i].px.cast<float>(), to, *warp, kSearched_px,
                                    PatchSearchOptions());
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

std::vector<size_t> PartnersOf(const Views& views, size_t first, int later_views, size_t count) {
  std::vector<size_t> partners;
  const size_t end = std::min(views.size(), first + 1 + static_cast<size_t>(later_views));
  for (size_t second = first + 1; second < end && partners.size() < count; ++second) {
    if (views[second].segment != views[first].segment) break;
    const auto [travel_m, turn_rad] = HowFarApart(views[first], views[second]);
    if (travel_m > kMinTravel_m && travel_m < kMaxTravel_m && turn_rad < kMaxTurn_rad) {
      partners.push_back(second);
    }
  }
  return partners;
}

}  // namespace slcmap
