#include "odometry/frontend/point_tracker.h"

#include <algorithm>
#include <cmath>

#include "odometry/frontend/corner_detector.h"
#include "odometry/frontend/patch.h"

namespace slcmap::inline odometry {
namespace {

constexpr double kMinCorrelation = 0.8;  // normalised, with the image where the point was detected
constexpr double kMaxEpipolar_px = 1.5;  // left to right, across the rectified row

constexpr double kMaxDisparity = 0.25;  // searched, of the image's width
constexpr float kMinRowCorrelation = 0.7f;
constexpr double kCloserShare = 0.5;  // of the least distance, where corners are few
constexpr int kAffineIterations = 2;
constexpr double kMinDisparity_px = -1;  // infinity, less the noise
constexpr int kCoarsestRight = 2;        // level from which a known disparity is followed

using PatchPyramid = std::vector<Patch>;

struct TrackedPoint {
  PatchPyramid anchor;  // the image where it was detected
  PatchWarp left;
  std::optional<Eigen::Vector2f> right_px;     // in the pair last given
  std::optional<Eigen::Vector2f> to_right_px;  // right less left, when it was last seen in both
  Eigen::Vector2f parallax_px = Eigen::Vector2f::Zero();  // of the last frame, beyond the rotation
};

}  // namespace

class PointTracker::Impl {
 public:
  Impl(const PointTrackerOptions& options, const Rig& rig, const cv::Mat& mask)
      : options_(options), camera_(rig.cameras[0]), mask_(mask), pattern_(options.patch_px) {}

  void Track(const cv::Mat& left, const Eigen::Quaterniond& R_now_previous) {
    left_ = BuildPyramid(left, options_.pyramid_levels);
    const Eigen::Matrix3d R = R_now_previous.toRotationMatrix();
    std::vector<PointObservation> kept_observations;
    std::vector<TrackedPoint> kept;
    for (size_t i = 0; i < points_.size(); ++i) {
      if (!Follow(R, &points_[i])) continue;
      kept_observations.push_back(Observe(observations_[i].id, points_[i]));
      kept.push_back(std::move(points_[i]));
    }
    observations_ = std::move(kept_observations);
    points_ = std::move(kept);
  }

  void Detect(const cv::Mat& right, double rows_move_px) {
    rows_move_px_ = rows_move_px;
    if (left_.empty()) return;
    DetectLeft();
    if (right.empty()) return;
    const ImagePyramid pyramid = BuildPyramid(right, kCoarsestRight + 1);
    for (size_t i = 0; i < points_.size(); ++i) {
      LookRight(pyramid, &points_[i]);
      observations_[i] = Observe(observations_[i].id, points_[i]);
    }
  }

  void Remove(const std::unordered_set<int64_t>& ids) {
    size_t kept = 0;
    for (size_t i = 0; i < points_.size(); ++i) {
      if (ids.contains(observations_[i].id)) continue;
      if (kept != i) {
        points_[kept] = std::move(points_[i]);
        observations_[kept] = observations_[i];
      }
      ++kept;
    }
    points_.resize(kept);
    observations_.resize(kept);
  }

  void Reset() {
    points_.clear();
    observations_.clear();
  }

  const std::vector<PointObservation>& observations() const { return observations_; }

 private:
  // Where there are few corners, they may lie closer to each other.
  void DetectLeft() {
    if (std::ssize(points_) >= options_.max_points) return;
    const double cell_px =
        std::max(options_.min_distance_px,
                 std::sqrt(static_cast<double>(left_[0].total()) / options_.max_points));
    CornerDetector detector(left_[0], mask_, cell_px, GradientNoise(left_[0], mask_),
                            options_.min_corner_gradient);
    for (const double share : {1.0, kCloserShare}) {
      AddCorners(share * options_.min_distance_px, &detector);
    }
  }

  void AddCorners(double min_distance_px, CornerDetector* detector) {
    const int room = options_.max_points - static_cast<int>(points_.size());
    if (room <= 0) return;
    std::vector<Eigen::Vector2d> occupied;
    for (const auto& p : observations_) occupied.push_back(p.left_px);
    for (const auto& px : detector->Find(occupied, room, min_distance_px)) {
      TrackedPoint p;
      p.left.center_px = EdgeCrossing(left_[0], px).cast<float>();
      if (!HasPlace(p.left.center_px, min_distance_px) || !Anchor(left_, &p)) continue;
      observations_.push_back(Observe(next_id_++, p));
      points_.push_back(std::move(p));
    }
  }

  // What was detected apart may move to the same place, or to where nothing may be seen.
  bool HasPlace(const Eigen::Vector2f& px, double min_distance_px) const {
    return IsSeen(px) && std::all_of(points_.begin(), points_.end(), [&](const TrackedPoint& p) {
             return (p.left.center_px - px).norm() >= static_cast<float>(min_distance_px);
           });
  }

  static PointObservation Observe(int64_t id, const TrackedPoint& p) {
    PointObservation o{id, p.left.center_px.cast<double>(), std::nullopt};
    if (p.right_px) o.right_px = p.right_px->cast<double>();
    return o;
  }

  bool Anchor(const ImagePyramid& pyramid, TrackedPoint* p) const {
    p->anchor.assign(pyramid.size(), Patch());
    for (size_t i = 0; i < pyramid.size(); ++i) {
      p->anchor[i].Extract(pattern_, pyramid[i], p->left.center_px / (1 << i), i == 0);
    }
    return !p->anchor[0].empty();
  }

  // Where a warp goes when the camera only rotates.
  PatchWarp Rotate(const Eigen::Matrix3d& R, const PatchWarp& warp) const {
    const Eigen::Vector3d ray((warp.center_px.x() - camera_.cx_px) / camera_.fx_px,
                              (warp.center_px.y() - camera_.cy_px) / camera_.fy_px, 1);
    const Eigen::Vector3d r = R * ray;
    if (r.z() < 0.1) return warp;
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1 / r.z(), 0, -r.x() / (r.z() * r.z()), 0, 1 / r.z(), -r.y() / (r.z() * r.z());
    const Eigen::Matrix2d jacobian = projection * R.leftCols<2>();
    const Eigen::Vector2d px(camera_.fx_px * r.x() / r.z() + camera_.cx_px,
                             camera_.fy_px * r.y() / r.z() + camera_.cy_px);
    return {px.cast<float>(), jacobian.cast<float>() * warp.affine};
  }

  // From the coarsest level down; -1 when lost.
  float AlignAll(const PatchPyramid& anchor, const ImagePyramid& pyramid, int coarsest,
                 PatchWarp* warp) const {
    for (int level = coarsest; level >= 0; --level) {
      if (anchor[level].empty()) continue;
      PatchWarp scaled = *warp;
      const float scale = static_cast<float>(1 << level);
      scaled.center_px /= scale;
      const float correlation = anchor[level].Align(pattern_, pyramid[level], level ? 4 : 6,
                                                    level ? 0.06f : 0.1f, &scaled);
      if (correlation < 0.3f) {
        if (level == 0) return -1;
        continue;
      }
      warp->center_px = scaled.center_px * scale;
    }
    if (anchor[0].AlignAffine(pattern_, pyramid[0], kAffineIterations, warp) < 0) return -1;
    return anchor[0].Correlation(pattern_, pyramid[0], *warp);
  }

  bool Follow(const Eigen::Matrix3d& R, TrackedPoint* p) const {
    const PatchWarp rotated = Rotate(R, p->left);
    PatchWarp warp = rotated;
    warp.center_px += p->parallax_px;
    if (!Accept(AlignAll(p->anchor, left_, options_.pyramid_levels - 1, &warp), warp,
                kMinCorrelation)) {
      return false;
    }
    p->parallax_px = warp.center_px - rotated.center_px;
    p->left = warp;
    p->right_px.reset();
    return true;
  }

  bool Accept(float correlation, const PatchWarp& warp, double min_correlation) const {
    if (correlation < min_correlation) return false;
    const float scale = warp.affine.determinant();
    if (scale < 0.3f || scale > 4.f) return false;
    return IsSeen(warp.center_px);
  }

  bool IsSeen(const Eigen::Vector2f& px) const {
    return camera_.Contains(px.cast<double>()) &&
           mask_.at<uchar>(static_cast<int>(std::lround(px.y())),
                           static_cast<int>(std::lround(px.x())));
  }

  bool AcceptRight(float correlation, const TrackedPoint& p, const PatchWarp& right) const {
    const Eigen::Vector2f d = p.left.center_px - right.center_px;
    return correlation >= kMinCorrelation && std::abs(d.y()) <= kMaxEpipolar_px + rows_move_px_ &&
           d.x() >= kMinDisparity_px - rows_move_px_;
  }

  // Where it was last seen, or else anywhere.
  void LookRight(const ImagePyramid& right, TrackedPoint* p) const {
    if (p->to_right_px) {
      p->right_px = AlignRight(right, *p, p->left.center_px + *p->to_right_px, kCoarsestRight);
    }
    if (!p->right_px) p->right_px = SearchRight(right, *p);
    p->to_right_px.reset();
    if (p->right_px) p->to_right_px = *p->right_px - p->left.center_px;
  }

  // Searches the whole row at half the resolution, then refines.
  std::optional<Eigen::Vector2f> SearchRight(const ImagePyramid& right,
                                             const TrackedPoint& p) const {
    const int level = left_.size() > 1 ? 1 : 0;
    const float scale = static_cast<float>(1 << level);
    const int reach = static_cast<int>(kMaxDisparity * camera_.width_px / scale);
    const auto match = SearchRow(left_[level], right[level], p.left.center_px / scale, reach);
    if (!match || match->correlation < kMinRowCorrelation) return std::nullopt;
    return AlignRight(right, p, match->right_px * scale, level);
  }

  std::optional<Eigen::Vector2f> AlignRight(const ImagePyramid& right, const TrackedPoint& p,
                                            const Eigen::Vector2f& start_px, int coarsest) const {
    PatchWarp warp{start_px, p.left.affine};
    const int levels = static_cast<int>(p.anchor.size());
    if (!AcceptRight(AlignAll(p.anchor, right, std::min(coarsest, levels - 1), &warp), p, warp)) {
      return std::nullopt;
    }
    return warp.center_px;
  }

  PointTrackerOptions options_;
  Camera camera_;
  cv::Mat mask_;
  PatchPattern pattern_;
  ImagePyramid left_;
  std::vector<TrackedPoint> points_;
  std::vector<PointObservation> observations_;  // of points_, in the same order
  int64_t next_id_ = 0;
  double rows_move_px_ = 0;  // of the right image last given
};

PointTracker::PointTracker(const PointTrackerOptions& options, const Rig& rectified_rig,
                           const cv::Mat& mask_left)
    : impl_(std::make_unique<Impl>(options, rectified_rig, mask_left)) {}
PointTracker::~PointTracker() = default;

void PointTracker::Track(const cv::Mat& left, const Eigen::Quaterniond& R_now_previous) {
  impl_->Track(left, R_now_previous);
}
void PointTracker::Detect(const cv::Mat& right, double rows_move_px) {
  impl_->Detect(right, rows_move_px);
}
void PointTracker::Remove(const std::unordered_set<int64_t>& ids) { impl_->Remove(ids); }
void PointTracker::Reset() { impl_->Reset(); }
const std::vector<PointObservation>& PointTracker::observations() const {
  return impl_->observations();
}

}  // namespace slcmap::odometry
