#include "odometry/tracked_cameras.h"

namespace slcmap::inline odometry {

TrackedPoints::TrackedPoints(PointTrackerOptions options, const Rectifier& rectifier,
                             const std::vector<CameraGroup>& groups, RectifiedImages* images)
    : trackers_(rectifier.rectified_rig(), groups), images_(images) {
  const auto count = static_cast<int>(groups.size());
  options.max_points = (options.max_points + count - 1) / count;  // all in all as many
  for (const CameraGroup& group : groups) {
    trackers_.Add(options, rectifier.rectified_rig(), rectifier.mask(group.first));
  }
}

void TrackedPoints::Track(const Eigen::Quaterniond& R_now_previous) {
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const cv::Mat& image = images_->of(trackers_.group(i).first);
    if (image.empty()) {
      trackers_.of(i).Reset();
    } else {
      trackers_.of(i).Track(image, trackers_.ToGroup(i, R_now_previous));
    }
  }
  trackers_.Join(std::vector<bool>(trackers_.size(), true));
}

void TrackedPoints::Detect() {
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const CameraGroup& group = trackers_.group(i);
    if (images_->of(group.first).empty()) continue;
    trackers_.of(i).Detect(images_->right_of(group), group.first == 0 ? rows_move_px_ : 0);
  }
  trackers_.Join(std::vector<bool>(trackers_.size(), true));
}

TrackedLines::TrackedLines(const LineTrackerOptions& options, const Rectifier& rectifier,
                           const std::vector<CameraGroup>& groups, RectifiedImages* images)
    : trackers_(rectifier.rectified_rig(), groups),
      images_(images),
      turns_(groups.size(), Eigen::Quaterniond::Identity()) {
  for (const auto& [first, is_pair] : groups) {
    trackers_.Add(options, rectifier.rectified_rig(), rectifier.mask(first),
                  is_pair ? rectifier.mask(first + 1) : cv::Mat());
  }
}

void TrackedLines::Track(const Eigen::Quaterniond& R_now_previous,
                         const std::vector<LinePrediction>& predictions,
                         const std::vector<Eigen::Vector3d>& axes_camera) {
  std::vector<bool> has_image;
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const CameraGroup& group = trackers_.group(i);
    const Eigen::Quaterniond turn = trackers_.ToGroup(i, R_now_previous);
    turns_[i] = i == 0 ? turn : turn * turns_[i];  // the first has all images
    has_image.push_back(!images_->of(group.first).empty());
    if (!has_image.back()) continue;
    trackers_.of(i).Track(images_->of(group.first), images_->right_of(group), turns_[i],
                          OfGroup(i, predictions), trackers_.ToGroup(i, axes_camera));
    turns_[i].setIdentity();
  }
  trackers_.Join(has_image);
}

std::vector<LinePrediction> TrackedLines::OfGroup(
    size_t group, const std::vector<LinePrediction>& predictions) const {
  std::vector<LinePrediction> own;
  for (LinePrediction prediction : predictions) {
    if (prediction.camera != trackers_.group(group).first) continue;
    prediction.id = trackers_.IdInTracker(prediction.id);
    own.push_back(prediction);
  }
  return own;
}

}  // namespace slcmap::odometry
