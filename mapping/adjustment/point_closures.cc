#include <algorithm>
#include <cmath>
#include <optional>

#include "mapping/adjustment/closure.h"
#include "mapping/views/view_matches.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Which views look at a place alike.
constexpr double kMaxAngle_rad = 0.35;     // at a point, between where the cameras are
constexpr double kMaxDistanceShare = 0.6;  // of how far away the farthest point is
constexpr double kMinNewPath_m = 0.3;      // between later keyframes that are searched
constexpr double kMaxSearch_px = 30;
constexpr double kMinClosureDepth_m = 0.3;
constexpr double kMaxScale = 1.5;      // of a patch in the later image, and one over it
constexpr double kSameShift_m = 0.02;  // between neighbouring keyframes that recognise a place
constexpr double kNear_m = 6;          // of path, within which they are neighbours

// A keyframe as a view.
struct PosedView {
  RigidTransform T_world_camera;
  double farthest_m = 0;         // that it sees
  std::vector<size_t> points;    // of the state, that it sees, in rising order
  std::vector<Vector2d> places;  // where, on the plane z = 1 as measured
};

std::vector<PosedView> CollectViews(const AdjustmentState& state, const StereoGeometry& geometry) {
  std::vector<PosedView> views(state.frames.size());
  for (size_t k = 0; k < views.size(); ++k) {
    views[k].T_world_camera = PoseFromBlock(state.frames[k].pose) * geometry.T_imu_camera[0];
  }
  for (size_t i = 0; i < state.points.size(); ++i) {
    const Vector3d p_world = PointInWorld(state.points[i], state);
    for (const AdjustedPointObservation& observation : state.points[i].observations) {
      if (observation.measurement.camera != 0) continue;  // whose images are looked at again
      PosedView& view = views[observation.frame];
      view.points.push_back(i);
      view.places.push_back(observation.measurement.left);
      view.farthest_m =
          std::max(view.farthest_m, (p_world - view.T_world_camera.translation).norm());
    }
  }
  return views;
}

// Between what was measured by the run's rectification and pixels of the images that are read
// again, which are rectified with what the run has found of the cameras.
class LeftPixels {
 public:
  LeftPixels(const ViewImages& images, const StereoGeometry& geometry)
      : geometry_(geometry),
        camera_(images.rig().cameras[0]),
        R_image_run_(images.rig().T_imu_camera[0].rotation.conjugate() *
                     geometry.T_imu_camera[0].rotation) {}

  Vector2d DistortToPixel(const Vector2d& true_plane) const {
    return PixelFromPlane(camera_, (R_image_run_ * true_plane.homogeneous()).hnormalized());
  }
  Vector2d UnprojectToPlane(const Vector2d& pixel_px) const {
    return (R_image_run_.conjugate() * PlaneFromPixel(camera_, pixel_px).homogeneous())
        .hnormalized();
  }
  Vector2d True(const Vector2d& measured) const { return geometry_.OnTruePlane(0, measured); }
  // The inverse of that, to far less than a pixel's hundredth.
  Vector2d Measured(const Vector2d& true_plane) const {
    Vector2d measured = true_plane;
    for (int i = 0; i < 3; ++i) measured += true_plane - True(measured);
    return measured;
  }
  double focal_px() const { return camera_.fx_px; }
  double width_px() const { return camera_.width_px; }
  double height_px() const { return camera_.height_px; }

 private:
  const StereoGeometry& geometry_;
  const Camera& camera_;
  Eigen::Quaterniond R_image_run_;
};

class PointSearch {
 public:
  PointSearch(const AdjustmentState& state, const ViewImages& images,
              const StereoGeometry& geometry, const ClosureOptions& options)
      : state_(state),
        images_(images),
        options_(options),
        geometry_(geometry.CorrectedBy(state.camera_calibration)),
        pixels_(images, geometry_),
        path_m_(PathLengths(state)),
        views_(CollectViews(state, geometry)) {
    for (const AdjustedPoint& point : state.points) {
      points_world_.push_back(PointInWorld(point, state));
    }
  }

  std::vector<Closure> Find(const Progress& progress) const {
    std::vector<Closure> closures;
    double searched_m = -kMinNewPath_m;
    int segment = -1;
    for (size_t newer = 0; newer < views_.size(); ++newer) {
      progress.ReportOrStop(static_cast<double>(newer) / static_cast<double>(views_.size()));
      if (GetKeyframe(newer).segment != segment) {
        segment = GetKeyframe(newer).segment;
        searched_m = -kMinNewPath_m;
      }
      if (path_m_[newer] - searched_m < kMinNewPath_m) continue;
      const auto older = MostAlike(newer);
      if (!older) continue;
      const cv::Mat newer_image = images_.Read(newer).left;
      if (newer_image.empty()) continue;
      searched_m = path_m_[newer];
      if (auto closure = Compare(*older, newer, newer_image)) {
        closures.push_back(std::move(*closure));
      }
    }
    return Thinned(Confirmed(closures));
  }

 private:
  const Keyframe& GetKeyframe(size_t frame) const { return *state_.frames[frame].keyframe; }

  bool IsEarlierVisit(size_t older, size_t newer) const {
    const Keyframe &a = GetKeyframe(older), &b = GetKeyframe(newer);
    return a.segment == b.segment &&
           ToSeconds(b.stamp_ns - a.stamp_ns) >= options_.min_interval_s &&
           path_m_[newer] - path_m_[older] >= options_.min_path_m;
  }

  // What odometry has followed from one to the other tells nothing new.
  bool IsTracked(size_t point, size_t newer) const {
    return std::ranges::binary_search(views_[newer].points, point);
  }

  // Whether a point that the older keyframe sees is in the newer image, seen from nearly the same
  // side and distance.
  bool LooksAlike(const Vector3d& p_world, const PosedView& older, const PosedView& newer) const {
    const Vector3d p = newer.T_world_camera.Inverse() * p_world;
    if (p.z() < kMinClosureDepth_m) return false;
    const Vector2d px = pixels_.DistortToPixel(p.hnormalized());
    if (!(px.x() >= 0 && px.y() >= 0 && px.x() < pixels_.width_px() &&
          px.y() < pixels_.height_px())) {
      return false;
    }
    const Vector3d from_older = p_world - older.T_world_camera.translation,
                   from_newer = p_world - newer.T_world_camera.translation;
    const double scale = from_older.norm() / from_newer.norm();
    return scale < kMaxScale && scale > 1 / kMaxScale &&
           from_older.normalized().dot(from_newer.normalized()) > std::cos(kMaxAngle_rad);
  }

  // False where no point of the older one can look alike, as is quickly told.
  static bool MayOverlap(const PosedView& older, const PosedView& newer) {
    const Vector3d apart_m = older.T_world_camera.translation - newer.T_world_camera.translation;
    const auto axis = [](const PosedView& view) {
      return Vector3d(view.T_world_camera.rotation * Vector3d::UnitZ());
    };
    return apart_m.norm() < kMaxDistanceShare * older.farthest_m &&
           axis(older).dot(axis(newer)) > 0;
  }

  // The keyframe of an earlier visit of whose points the most look alike in the newer one.
  std::optional<size_t> MostAlike(size_t newer) const {
    std::optional<size_t> best;
    int64_t most = options_.min_points - 1;
    for (size_t older = 0; older < newer; ++older) {
      if (!IsEarlierVisit(older, newer) || !MayOverlap(views_[older], views_[newer])) continue;
      const auto count = std::ranges::count_if(views_[older].points, [&](size_t point) {
        return !IsTracked(point, newer) &&
               LooksAlike(points_world_[point], views_[older], views_[newer]);
      });
      if (count <= most) continue;
      most = count;
      best = older;
    }
    return best;
  }

  // How offsets about a point's place in the older image look in the newer one, for a surface that
  // faces the older camera.
  std::optional<PatchWarp> ComputeWarp(const Vector3d& p_older,
                                       const RigidTransform& T_newer_older) const {
    const auto project = [&](const Vector3d& p) {
      return pixels_.DistortToPixel((T_newer_older * p).hnormalized());
    };
    if ((T_newer_older * p_older).z() < kMinClosureDepth_m) return std::nullopt;
    const Vector2d centre = project(p_older);
    const double step = p_older.z() / pixels_.focal_px();
    Eigen::Matrix2d affine;
    affine << project(p_older + step * Vector3d::UnitX()) - centre,
        project(p_older + step * Vector3d::UnitY()) - centre;
    const double scale = std::sqrt(std::abs(affine.determinant()));
    if (!(scale < kMaxScale && scale > 1 / kMaxScale)) return std::nullopt;
    return PatchWarp{centre.cast<float>(), affine.cast<float>()};
  }

  // Where a point that the older keyframe sees may be in the newer one.
  std::vector<Vector2d> Search(size_t older, size_t index, size_t newer, const cv::Mat& older_image,
                               const cv::Mat& newer_image, const Vector3d& p_world) const {
    const PosedView &from = views_[older], &to = views_[newer];
    const Vector3d p_older = from.T_world_camera.Inverse() * p_world;
    if (p_older.z() < kMinClosureDepth_m) return {};
    const auto warp = ComputeWarp(p_older, to.T_world_camera.Inverse() * from.T_world_camera);
    if (!warp) return {};
    const double path_m = path_m_[newer] - path_m_[older];
    const ShiftSigma sigma = SigmaOver(path_m, options_);
    const double within_px =
        3 * pixels_.focal_px() * (sigma.position_m / p_older.z() + sigma.yaw_rad) +
        options_.point_tolerance_px;
    const Vector2d from_px = pixels_.DistortToPixel(pixels_.True(from.places[index]));
    std::vector<Vector2d> places;
    for (const Eigen::Vector2f& px : SearchPatch(older_image, from_px.cast<float>(), newer_image,
                                                 *warp, std::min(within_px, kMaxSearch_px))) {
      places.push_back(pixels_.UnprojectToPlane(px.cast<double>()));
    }
    return places;
  }

  // In units of the tolerance.
  ShiftVote MakeVote(const PosedView& newer, const Vector3d& p_world,
                     const std::vector<Vector2d>& places) const {
    const Vector3d p = newer.T_world_camera.Inverse() * p_world;
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
    const Eigen::Matrix3d R_camera_world =
        newer.T_world_camera.rotation.conjugate().toRotationMatrix();
    Eigen::Matrix<double, 3, 4> moved;
    moved << Eigen::Matrix3d::Identity(),
        Vector3d::UnitZ().cross(p_world - newer.T_world_camera.translation);
    const double per_tolerance = pixels_.focal_px() / options_.point_tolerance_px;
    ShiftVote vote;
    vote.by_shift = -per_tolerance * by_point * R_camera_world * moved;
    for (const Vector2d& place : places) {
      vote.alternatives.emplace_back(per_tolerance * (place - p.hnormalized()));
    }
    return vote;
  }

  std::optional<Closure> Compare(size_t older, size_t newer, const cv::Mat& newer_image) const {
    const cv::Mat older_image = images_.Read(older).left;
    if (older_image.empty()) return std::nullopt;
    std::vector<ShiftVote> votes;
    std::vector<PointMatch> matches;  // a row an alternative of each vote
    std::vector<size_t> first_match;
    for (size_t i = 0; i < views_[older].points.size(); ++i) {
      const size_t point = views_[older].points[i];
      if (IsTracked(point, newer)) continue;
      const Vector3d& p_world = points_world_[point];
      const std::vector<Vector2d> places =
          Search(older, i, newer, older_image, newer_image, p_world);
      if (places.empty()) continue;
      votes.push_back(MakeVote(views_[newer], p_world, places));
      first_match.push_back(matches.size());
      for (const Vector2d& place : places) {
        matches.push_back({point, newer, pixels_.Measured(place)});
      }
    }
    const Agreement agreement = FindAgreement(
        votes, SigmaOver(path_m_[newer] - path_m_[older], options_), kClosureMinDisplacement_m);
    if (!IsUnique(agreement, options_.min_points)) return std::nullopt;
    Closure closure{older, newer, agreement.shift, {}, {}, false};
    for (size_t i = 0; i < votes.size(); ++i) {
      if (agreement.chosen[i] < 0) continue;
      closure.points.push_back(matches[first_match[i] + static_cast<size_t>(agreement.chosen[i])]);
    }
    return closure;
  }

  bool AreNear(size_t a, size_t b) const {
    return GetKeyframe(a).segment == GetKeyframe(b).segment &&
           std::abs(path_m_[a] - path_m_[b]) < kNear_m;
  }

  // Those that some neighbours agree with, and most of them do: odometry knows how neighbours lie
  // to each other.
  std::vector<Closure> Confirmed(const std::vector<Closure>& found) const {
    std::vector<Closure> confirmed;
    for (const Closure& closure : found) {
      int near = 0, agreeing = 0;
      for (const Closure& other : found) {
        if (!AreNear(closure.newer_frame, other.newer_frame)) continue;
        ++near;
        agreeing += (other.shift - closure.shift).head<3>().norm() < kSameShift_m;
      }
      if (agreeing >= kClosureMinKeyframes && 2 * agreeing > near) confirmed.push_back(closure);
    }
    return confirmed;
  }

  // Evenly along the way.
  std::vector<Closure> Thinned(const std::vector<Closure>& closures) const {
    const auto most = static_cast<size_t>(options_.max_point_closures);
    const size_t step = std::max<size_t>(1, (closures.size() + most - 1) / most);
    std::vector<Closure> thinned;
    for (size_t i = 0; i < closures.size(); i += step) thinned.push_back(closures[i]);
    return thinned;
  }

  const AdjustmentState& state_;
  const ViewImages& images_;
  const ClosureOptions& options_;
  const StereoGeometry geometry_;
  const LeftPixels pixels_;
  const std::vector<double> path_m_;
  const std::vector<PosedView> views_;
  std::vector<Vector3d> points_world_;
};

}  // namespace

std::vector<Closure> FindPointClosures(const AdjustmentState& state, const ViewImages& images,
                                       const StereoGeometry& geometry,
                                       const ClosureOptions& options, const Progress& progress) {
  return PointSearch(state, images, geometry, options).Find(progress);
}

}  // namespace slcmap::mapping
