#include "odometry/frontend/point_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace slcmap {
namespace {

constexpr double kMinDisparity_px = -1;  // infinity, less the noise

cv::Point2f ToCv(const Eigen::Vector2d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

struct Flow {
  std::vector<cv::Point2f> points;
  std::vector<uchar> found;
};

}  // namespace

class PointTracker::Impl {
 public:
  Impl(const PointTrackerOptions& options, const Rig& rig, const cv::Mat& mask)
      : options_(options), camera_(rig.cameras[0]), mask_(mask) {}

  void Track(const cv::Mat& left, const cv::Mat& right, const Eigen::Quaterniond& R_now_previous) {
    std::vector<cv::Mat> pyramid = Pyramid(left);
    if (!points_.empty() && !pyramid_left_.empty()) FollowLeft(pyramid, R_now_previous);
    left_ = left;
    pyramid_left_ = std::move(pyramid);
    pyramid_right_ = right.empty() ? std::vector<cv::Mat>() : Pyramid(right);
    FindRight(0);
  }

  void Detect() {
    const size_t old_count = points_.size();
    if (left_.empty() || static_cast<int>(old_count) >= options_.max_points) return;
    cv::Mat free = mask_.clone();
    for (const auto& p : points_) {
      cv::circle(free, ToCv(p.left_px), static_cast<int>(options_.min_distance_px), 0, cv::FILLED);
    }
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(left_, corners, options_.max_points - static_cast<int>(old_count),
                            options_.min_corner_quality, options_.min_distance_px, free);
    for (const auto& c : corners) points_.push_back({next_id_++, {c.x, c.y}, std::nullopt});
    FindRight(old_count);
  }

  void Remove(const std::unordered_set<int64_t>& ids) {
    std::erase_if(points_, [&](const PointObservation& p) { return ids.contains(p.id); });
  }

  void Reset() { points_.clear(); }

  const std::vector<PointObservation>& observations() const { return points_; }

 private:
  std::vector<cv::Mat> Pyramid(const cv::Mat& image) const {
    std::vector<cv::Mat> pyramid;
    cv::buildOpticalFlowPyramid(image, pyramid, {options_.patch_px, options_.patch_px},
                                options_.pyramid_levels - 1, true);
    return pyramid;
  }

  Flow Follow(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to,
              const std::vector<cv::Point2f>& points, std::vector<cv::Point2f> guess,
              int levels) const {
    Flow flow{std::move(guess), {}};
    cv::calcOpticalFlowPyrLK(from, to, points, flow.points, flow.found, cv::noArray(),
                             {options_.patch_px, options_.patch_px}, levels - 1,
                             {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 15, 0.02},
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    return flow;
  }

  // True where following `flow` back ends where it began.
  std::vector<bool> Consistent(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to,
                               const std::vector<cv::Point2f>& points, const Flow& flow) const {
    const Flow back = Follow(to, from, flow.points, points, 2);
    std::vector<bool> good(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
      good[i] = flow.found[i] && back.found[i] &&
                cv::norm(back.points[i] - points[i]) <= options_.max_forward_backward_px;
    }
    return good;
  }

  cv::Point2f Predict(const Eigen::Vector2d& px, const Eigen::Matrix3d& R_now_previous) const {
    const Eigen::Vector3d ray((px.x() - camera_.cx_px) / camera_.fx_px,
                              (px.y() - camera_.cy_px) / camera_.fy_px, 1);
    const auto predicted = camera_.Project(R_now_previous * ray);
    return predicted && camera_.Contains(*predicted) ? ToCv(*predicted) : ToCv(px);
  }

  void FollowLeft(const std::vector<cv::Mat>& pyramid, const Eigen::Quaterniond& R_now_previous) {
    const Eigen::Matrix3d R = R_now_previous.toRotationMatrix();
    std::vector<cv::Point2f> previous, guess;
    for (const auto& p : points_) {
      previous.push_back(ToCv(p.left_px));
      guess.push_back(Predict(p.left_px, R));
    }
    const Flow flow = Follow(pyramid_left_, pyramid, previous, guess, options_.pyramid_levels);
    const auto good = Consistent(pyramid_left_, pyramid, previous, flow);
    std::vector<PointObservation> kept;
    for (size_t i = 0; i < points_.size(); ++i) {
      PointObservation p = points_[i];
      p.left_px = {flow.points[i].x, flow.points[i].y};
      if (p.right_px) *p.right_px += p.left_px - points_[i].left_px;
      if (good[i] && InMask(p.left_px)) kept.push_back(p);
    }
    points_ = std::move(kept);
  }

  bool InMask(const Eigen::Vector2d& px) const {
    return camera_.Contains(px) && mask_.at<uchar>(static_cast<int>(std::lround(px.y())),
                                                   static_cast<int>(std::lround(px.x()))) != 0;
  }

  // Finds the points from index `first` on in the right image.
  void FindRight(size_t first) {
    std::vector<cv::Point2f> left, guess;
    for (size_t i = first; i < points_.size(); ++i) {
      left.push_back(ToCv(points_[i].left_px));
      guess.push_back(ToCv(points_[i].right_px.value_or(points_[i].left_px)));
      points_[i].right_px.reset();
    }
    if (left.empty() || pyramid_right_.empty()) return;
    const Flow flow = Follow(pyramid_left_, pyramid_right_, left, guess, options_.pyramid_levels);
    const auto good = Consistent(pyramid_left_, pyramid_right_, left, flow);
    for (size_t i = 0; i < left.size(); ++i) {
      const Eigen::Vector2d right(flow.points[i].x, flow.points[i].y);
      if (good[i] && camera_.Contains(right) &&
          std::abs(right.y() - left[i].y) <= options_.max_epipolar_px &&
          left[i].x - right.x() >= kMinDisparity_px) {
        points_[first + i].right_px = right;
      }
    }
  }

  PointTrackerOptions options_;
  Camera camera_;
  cv::Mat mask_;
  cv::Mat left_;
  std::vector<cv::Mat> pyramid_left_, pyramid_right_;
  std::vector<PointObservation> points_;
  int64_t next_id_ = 0;
};

PointTracker::PointTracker(const PointTrackerOptions& options, const Rig& rectified_rig,
                           const cv::Mat& mask_left) {
  options.Check();
  impl_ = std::make_unique<Impl>(options, rectified_rig, mask_left);
}
PointTracker::~PointTracker() = default;

void PointTracker::Track(const cv::Mat& left, const cv::Mat& right,
                         const Eigen::Quaterniond& R_now_previous) {
  impl_->Track(left, right, R_now_previous);
}
void PointTracker::Detect() { impl_->Detect(); }
void PointTracker::Remove(const std::unordered_set<int64_t>& ids) { impl_->Remove(ids); }
void PointTracker::Reset() { impl_->Reset(); }
const std::vector<PointObservation>& PointTracker::observations() const {
  return impl_->observations();
}

}  // namespace slcmap
