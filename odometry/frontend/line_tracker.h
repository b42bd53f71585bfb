// Straight edges, followed from keyframe to keyframe and from left to right, and which of the
// segments found become tracked lines.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <unordered_set>
#include <vector>

#include "data/core/camera.h"
#include "data/core/types.h"
#include "odometry/frontend/options.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline odometry {

// The axis (index into axes_camera, unit) whose vanishing point a segment of a pinhole image points
// to, or -1. Of no concern how certain that is: it ranks what is tracked, and the LineClassifier
// judges it later.
int FindAxis(const LineSegment& segment, const Camera& camera,
             const std::vector<Eigen::Vector3d>& axes_camera);

// The indices of at most `room` candidates that are long, lie along an axis, and are spread over
// image and directions, given those that are `kept` already. Best first.
std::vector<int> SelectSegments(const std::vector<LineSegment>& candidates,
                                const std::vector<LineSegment>& kept, const Camera& camera,
                                const std::vector<Eigen::Vector3d>& axes_camera, int room);

// Straight edges, followed from keyframe to keyframe and from left to right.

class LineTracker {
 public:
  // rectified_rig and masks as a Rectifier gives them.
  LineTracker(const LineTrackerOptions& options, const Rig& rectified_rig, const cv::Mat& mask_left,
              const cv::Mat& mask_right);
  ~LineTracker();

  // Takes the next pair; it need not be the very next image. `right` is empty with one camera.
  // R_now_previous is the rotation of the left camera since the pair given last
  // (p_now = R_now_previous * p_previous). `predictions` says where lines that are known in 3D are
  // expected, also such as were not seen for a while; those of unknown ids are ignored.
  // axes_camera: unit directions of the building's axes in the left camera, where they are known.
  // A line that is not found stays known: for good while it is predicted, else for a few calls.
  void Track(const cv::Mat& left, const cv::Mat& right, const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera);

  // Forgets lines for good; ids are never reused.
  void Remove(const std::unordered_set<int64_t>& ids);

  // Forgets all lines; ids go on.
  void Reset();

  // The lines seen in the pair last given, sorted by id; at most max_lines. Each starts where the
  // bright side is on its left.
  const std::vector<LineObservation>& observations() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap::odometry
