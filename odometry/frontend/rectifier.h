// Brings the images of a stereo rig (also a fisheye one) to a common ideal pinhole, and tells those
// that a hanging camera has delivered again.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "data/core/types.h"
#include "odometry/frontend/options.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline odometry {

// Both rectified cameras are distortion-free pinholes of the same intrinsics and orientation, the
// right one displaced along +x of the left, so that a point has the same row in both. Two that look
// apart keep their orientations; of a fisheye the field of view is as wide as the options have it.
class Rectifier {
 public:
  Rectifier(const Rig& rig, const RectifierOptions& options);

  // From now on right images are rectified as if the right camera were so, against the given
  // calibration. rectified_rig() and masks stay.
  void CorrectRight(const RightCorrection& correction);

  // The rig that the rectified images belong to.
  const Rig& rectified_rig() const { return rectified_rig_; }

  // camera: 0 left, 1 right. The result has the rectified camera's size; pixels that no camera
  // pixel maps to are black.
  cv::Mat Rectify(const cv::Mat& image, int camera) const;

  // 255 where the rectified image has true pixels of the building, not of what moves with the rig
  // (eroded by a small margin), else 0.
  const cv::Mat& mask(int camera) const { return masks_[camera]; }

 private:
  Rig given_rig_, rectified_rig_;
  std::array<cv::Mat, 2> map_xy_;        // CV_16SC2
  std::array<cv::Mat, 2> map_fraction_;  // CV_16UC1
  std::array<cv::Mat, 2> masks_;
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
