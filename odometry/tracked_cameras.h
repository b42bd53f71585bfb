// What follows the points and lines of all cameras of a rig for the estimator.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_set>
#include <vector>

#include "odometry/frontend/line_tracker.h"
#include "odometry/frontend/point_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/window/estimator.h"

namespace slcmap::inline odometry {

// The images in process. Those beside the left one are decoded and rectified once they are asked
// for; points and lines may ask at the same time.
class RectifiedImages {
 public:
  void Set(cv::Mat left, int cameras, std::function<cv::Mat(int camera)> rectify) {
    images_.assign(static_cast<size_t>(cameras), std::nullopt);
    images_[0] = std::move(left);
    rectify_ = std::move(rectify);
  }
  // Empty where there is none.
  const cv::Mat& of(int camera) {
    const std::lock_guard lock(mutex_);
    std::optional<cv::Mat>& image = images_[static_cast<size_t>(camera)];
    if (!image) image = rectify_(camera);
    return *image;
  }
  // Of the right camera of a group that is a pair; empty of others.
  cv::Mat right_of(const CameraGroup& group) {
    return group.is_pair ? of(group.first + 1) : cv::Mat();
  }

 private:
  std::mutex mutex_;  // guards what follows
  std::vector<std::optional<cv::Mat>> images_;
  std::function<cv::Mat(int camera)> rectify_;
};

// Each pair of cameras, or lone camera, is followed by a tracker of its own, whose observations are
// joined. Outside, ids of the trackers take turns.
template <typename Tracker, typename Observation>
class Trackers {
 public:
  Trackers(const Rig& rig, const std::vector<CameraGroup>& groups) : groups_(groups) {
    for (const CameraGroup& group : groups) {
      R_group_first_.push_back(rig.T_imu_camera[group.first].rotation.conjugate() *
                               rig.T_imu_camera[0].rotation);
    }
  }

  template <typename... Arguments>
  void Add(const Arguments&... arguments) {
    trackers_.push_back(std::make_unique<Tracker>(arguments...));
  }

  size_t size() const { return groups_.size(); }
  Tracker& of(size_t group) { return *trackers_[group]; }
  const CameraGroup& group(size_t group) const { return groups_[group]; }
  // Turns of a group's first camera, and directions in it, from those of the rig's first.
  Eigen::Quaterniond ToGroup(size_t group, const Eigen::Quaterniond& turn_of_first) const {
    if (group == 0) return turn_of_first;
    return R_group_first_[group] * turn_of_first * R_group_first_[group].conjugate();
  }
  std::vector<Eigen::Vector3d> ToGroup(size_t group,
                                       std::vector<Eigen::Vector3d> directions) const {
    if (group == 0) return directions;
    for (Eigen::Vector3d& direction : directions) direction = R_group_first_[group] * direction;
    return directions;
  }

  size_t GroupOfId(int64_t outside_id) const {
    return static_cast<size_t>(outside_id) % groups_.size();
  }
  int64_t IdInTracker(int64_t outside_id) const {
    return outside_id / static_cast<int64_t>(groups_.size());
  }

  const std::vector<Observation>& observations() const {
    return groups_.size() > 1 ? joined_ : trackers_[0]->observations();
  }
  // Once they have seen their images; of groups that have none nothing is told.
  void Join(const std::vector<bool>& has_image) {
    if (groups_.size() == 1) return;
    joined_.clear();
    const auto count = static_cast<int64_t>(groups_.size());
    for (size_t group = 0; group < groups_.size(); ++group) {
      if (!has_image[group]) continue;
      for (Observation seen : trackers_[group]->observations()) {
        seen.id = count * seen.id + static_cast<int64_t>(group);
        seen.camera = groups_[group].first;
        joined_.push_back(seen);
      }
    }
    std::ranges::sort(joined_, {}, &Observation::id);
  }

  void Remove(const std::unordered_set<int64_t>& ids) {
    if (groups_.size() == 1) return trackers_[0]->Remove(ids);
    std::vector<std::unordered_set<int64_t>> own(groups_.size());
    for (const int64_t id : ids) own[GroupOfId(id)].insert(IdInTracker(id));
    for (size_t group = 0; group < own.size(); ++group) trackers_[group]->Remove(own[group]);
    std::erase_if(joined_, [&](const Observation& seen) { return ids.contains(seen.id); });
  }
  void Reset() {
    for (const auto& tracker : trackers_) tracker->Reset();
    joined_.clear();
  }

 private:
  std::vector<CameraGroup> groups_;
  std::vector<Eigen::Quaterniond> R_group_first_;  // the groups' first cameras from the rig's
  std::vector<std::unique_ptr<Tracker>> trackers_;
  std::vector<Observation> joined_;  // of several groups, by id
};

// Points of all cameras of a rig, as the estimator asks for them.
class TrackedPoints final : public PointSource {
 public:
  TrackedPoints(PointTrackerOptions options, const Rectifier& rectifier,
                const std::vector<CameraGroup>& groups, RectifiedImages* images);
  void Track(const Eigen::Quaterniond& R_now_previous);
  const std::vector<PointObservation>& observations() const override {
    return trackers_.observations();
  }
  void Detect() override;
  // By how much points may be off their rows in right images of the first pair.
  void SetRowsMove(double rows_move_px) { rows_move_px_ = rows_move_px; }
  void Remove(const std::unordered_set<int64_t>& ids) override { trackers_.Remove(ids); }
  void Reset() override { trackers_.Reset(); }

 private:
  Trackers<PointTracker, PointObservation> trackers_;
  RectifiedImages* images_;
  double rows_move_px_ = 0;
};

// Lines of all cameras of a rig, as the estimator asks for them.
class TrackedLines final : public LineSource {
 public:
  TrackedLines(const LineTrackerOptions& options, const Rectifier& rectifier,
               const std::vector<CameraGroup>& groups, RectifiedImages* images);
  void Track(const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera) override;
  const std::vector<LineObservation>& observations() const override {
    return trackers_.observations();
  }
  void Remove(const std::unordered_set<int64_t>& ids) override { trackers_.Remove(ids); }
  void Reset() override { trackers_.Reset(); }

 private:
  // What of predictions is of a group, under its tracker's ids.
  std::vector<LinePrediction> OfGroup(size_t group,
                                      const std::vector<LinePrediction>& predictions) const;

  Trackers<LineTracker, LineObservation> trackers_;
  RectifiedImages* images_;
  std::vector<Eigen::Quaterniond> turns_;  // since the groups' last images
};

}  // namespace slcmap::odometry
