// Right images as the left camera would show them in size, for following features between both.
#pragma once

#include <opencv2/core.hpp>

#include "data/types.h"

namespace slcmap {

// Cameras of one size and about one focal length are left as they are. Others' right images are
// scaled to the left focal length, and both filled up on the right and below to one size.
class LikeLeft {
 public:
  explicit LikeLeft(const Rig& rig);

  cv::Mat Left(const cv::Mat& left) const;
  cv::Mat Right(const cv::Mat& right) const;

  // Between pixels of the right camera and those of Right().
  cv::Point2f FromRight(const cv::Point2f& px) const;
  cv::Point2f ToRight(const cv::Point2f& px) const;

 private:
  float scale_ = 1;
  cv::Size scaled_, filled_;  // of right images, and of both
};

}  // namespace slcmap
