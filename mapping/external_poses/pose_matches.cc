#include <algorithm>
#include <optional>
#include <ranges>
#include <utility>

#include "data/core/error.h"
#include "data/core/parallel.h"
#include "data/io/yaml.h"
#include "mapping/external_poses/pose_adjustment.h"
#include "mapping/views/stereo_depth.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

// Of its depth: loose, as far points of all pairs share errors of a tenth of a pixel, which would
// bend the way. How far views are apart is told by the poses.
constexpr double kDisparitySigma_px = 3;
constexpr int kPartners = 8;          // views that points of one are looked for in
constexpr double kMaxTravel_m = 1.5;  // to them
constexpr double kPoseMaxTurn_rad = 0.5;

constexpr OptionTable kTable{
    Option{"adjust", &ExternalPoseOptions::adjust, false, true},
    Option{"sigma_m", &ExternalPoseOptions::sigma_m, 1e-6, 10.0},
    Option{"sigma_rad", &ExternalPoseOptions::sigma_rad, 1e-6, 1.0},
    Option{"point_sigma_px", &ExternalPoseOptions::point_sigma_px, 0.01, 10.0},
    Option{"max_iterations", &ExternalPoseOptions::max_iterations, 1, 1000}};

}  // namespace

void ExternalPoseOptions::Check() const { kTable.Check("mapping.given_poses", *this); }

void ExternalPoseOptions::Read(YamlSection section) {
  section.Skip("threads");  // as options.yaml of earlier maps has it
  kTable.Read(section, this,
              {"good_px", "body_sigma_m", "body_sigma_rad", "clock_sigma_s", "disparity_sigma_px",
               "robust_sigmas", "partners", "max_travel_m", "max_turn_rad", "rounds"});
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMinPoints = 12;     // of a pair of views
constexpr size_t kAtOnce = 8;      // views, between which it may be ended
constexpr size_t kMaxPoints = 60;  // the best corners of it: more say the same, and take memory

// How far two views are from each other, for what they see in common: a metre counts as a radian.
// The nearest views that look at about the same.
std::vector<size_t> PartnersNear(const Views& views, size_t of) {
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < views.size(); ++i) {
    if (i == of || views[i].segment != views[of].segment) continue;
    const auto [travel_m, turn_rad] = HowFarApart(views[of], views[i]);
    if (travel_m > kMaxTravel_m || turn_rad > kPoseMaxTurn_rad) continue;
    near.emplace_back(travel_m + turn_rad, i);
  }
  std::ranges::sort(near);
  near.resize(std::min(near.size(), static_cast<size_t>(kPartners)));
  std::vector<size_t> partners;
  for (const auto& [apart, view] : near) partners.push_back(view);
  std::ranges::sort(partners);
  return partners;
}

std::vector<PoseMatch> FindMatches(size_t from, const Views& views,
                                   const std::vector<ViewPoint>& points, const ViewImages& images) {
  if (points.empty()) return {};
  const std::vector<size_t> partners = PartnersNear(views, from);
  if (partners.empty()) return {};
  const Rig& rig = images.rig();
  const Camera& camera = rig.cameras[0];
  const cv::Mat left = images.Read(from).left;
  if (left.empty()) return {};
  const double sigma = kDisparitySigma_px / (Baseline_m(rig) * camera.fx_px);
  const RigidTransform T_world_from = WorldFromCamera(views[from], rig);
  std::vector<PoseMatch> matches;
  for (const size_t to : partners) {
    const cv::Mat image = images.Read(to).left;
    if (image.empty()) continue;
    const ViewMatches found = MatchPoints(points, left, image, camera,
                                          WorldFromCamera(views[to], rig).Inverse() * T_world_from);
    if (std::ssize(found.found) < kMinPoints) continue;
    for (const ViewMatch& match : found.found | std::views::take(kMaxPoints)) {
      const ViewPoint& point = points[match.point];
      const Vector3d p = PinholeRay(camera, point.px.x(), point.px.y()) / point.inverse_depth;
      matches.push_back({from, to, p, sigma, match.px});
    }
  }
  return matches;
}

}  // namespace

std::optional<Vector2d> OffMatch_px(const PoseMatch& match, const Views& views, const Rig& rig) {
  constexpr double kMinDepth_m = 0.05;
  const Vector3d p = WorldFromCamera(views[match.to], rig).Inverse() *
                     (WorldFromCamera(views[match.from], rig) * match.p_from);
  if (!(p.z() > kMinDepth_m)) return std::nullopt;
  return PixelFromPlane(rig.cameras[0], Vector2d(p.hnormalized())) - match.px;
}

std::vector<std::vector<ViewPoint>> PointsOfViews(const Views& views, const ViewImages& images,
                                                  const Progress& progress) {
  std::vector<std::vector<ViewPoint>> points(views.size());
  const auto find = [&](size_t view) { points[view] = PointsOfView(images.Read(view), images); };
  if (!ForEachWatched(views.size(), progress, find, kAtOnce)) throw StoppedError("interrupted");
  return points;
}

std::vector<PoseMatch> MatchViews(const Views& views,
                                  const std::vector<std::vector<ViewPoint>>& points,
                                  const ViewImages& images, const Progress& progress) {
  std::vector<std::vector<PoseMatch>> of_views(views.size());
  const auto match = [&](size_t view) {
    of_views[view] = FindMatches(view, views, points[view], images);
  };
  if (!ForEachWatched(views.size(), progress, match, kAtOnce)) throw StoppedError("interrupted");
  std::vector<PoseMatch> matches;
  for (const std::vector<PoseMatch>& of_view : of_views) {
    matches.insert(matches.end(), of_view.begin(), of_view.end());
  }
  return matches;
}

}  // namespace slcmap::mapping
