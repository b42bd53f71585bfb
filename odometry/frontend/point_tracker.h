// Sparse points, followed from image to image and from left to right.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <unordered_set>
#include <vector>

#include "data/core/types.h"
#include "odometry/frontend/options.h"

namespace slcmap::inline odometry {

class PointTracker {
 public:
  // rectified_rig and mask_left as a Rectifier gives them.
  PointTracker(const PointTrackerOptions& options, const Rig& rectified_rig,
               const cv::Mat& mask_left);
  ~PointTracker();

  // Follows all points into the next left image. R_now_previous is the predicted rotation of the
  // left camera (p_now = R_now_previous * p_previous), for instance from the gyroscope. A point
  // that is lost is gone for good; its id is never reused.
  void Track(const cv::Mat& left, const Eigen::Quaterniond& R_now_previous);

  // Detects new points where there are none, up to max_points, in the left image last given, and
  // finds all points in the right image that belongs to it (empty with one camera), whose rows may
  // be off by so much more than they are by noise. Called on keyframes.
  void Detect(const cv::Mat& right, double rows_move_px = 0);

  // Forgets points, for instance those that the estimator found to be outliers.
  void Remove(const std::unordered_set<int64_t>& ids);

  // Forgets all points; ids go on.
  void Reset();

  // The points of the left image last given, sorted by id.
  const std::vector<PointObservation>& observations() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slcmap::odometry
