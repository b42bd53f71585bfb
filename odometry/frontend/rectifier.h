// Brings the images of a rig (also a fisheye one) to a common ideal pinhole, and tells those
// that a hanging camera has delivered again.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/core/types.h"
#include "odometry/frontend/options.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline odometry {

// All rectified cameras are distortion-free pinholes of the same intrinsics. Those of a pair have
// the same orientation, the right one displaced along +x of the left, so that a point has the same
// row in both. Others keep theirs; of a fisheye the field of view is as wide as the options have
// it.
class Rectifier {
 public:
  Rectifier(const Rig& rig, const RectifierOptions& options);

  // From now on right images are rectified as if the right camera were so, against the given
  // calibration. rectified_rig() and masks stay.
  void CorrectRight(const RightCorrection& correction);

  // The rig that the rectified images belong to.
  const Rig& rectified_rig() const { return rectified_rig_; }

  // The result has the rectified camera's size; pixels that no camera
  // pixel maps to are black.
  cv::Mat Rectify(const cv::Mat& image, int camera) const;

  // 255 where the rectified image has true pixels of the building, not of what moves with the rig
  // (eroded by a small margin), else 0.
  const cv::Mat& mask(int camera) const { return masks_[camera]; }

 private:
  Rig given_rig_, rectified_rig_;
  void SetUp(int camera, const Camera& pinhole, const Eigen::Quaterniond& R_imu_rectified);

  std::vector<cv::Mat> map_xy_;        // by camera, CV_16SC2
  std::vector<cv::Mat> map_fraction_;  // CV_16UC1
  std::vector<cv::Mat> masks_;
};

// Tells images that a hanging camera has delivered again.

class RepeatedImages {
 public:
  // Whether the image is, byte by byte, the one before. An image of one grey value is none:
  // darkness looks the same however the rig moves. Takes a copy.
  bool Repeats(const cv::Mat& image);

 private:
  cv::Mat last_;
};

}  // namespace slcmap::odometry
