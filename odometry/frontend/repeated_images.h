// Tells images that a hanging camera has delivered again.
#pragma once

#include <opencv2/core/mat.hpp>

namespace slcmap {

class RepeatedImages {
 public:
  // Whether the image is, byte by byte, the one before. An image of one grey value is none:
  // darkness looks the same however the rig moves. Takes a copy.
  bool Repeats(const cv::Mat& image);

 private:
  cv::Mat last_;
};

}  // namespace slcmap
