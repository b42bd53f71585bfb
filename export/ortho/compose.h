// The orthophoto of a face out of the photos that were chosen.
#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "export/ortho/choice.h"

namespace slcmap::inline exporting {

// An image as it was taken, and its camera: turned against the rectified one, from the same place.
struct RawPhoto {
  cv::Mat image;  // empty: it cannot be read
  Camera camera;
  Eigen::Quaterniond R_raw_rectified;
};

struct Orthophoto {
  cv::Mat grey;            // 8 bit
  cv::Mat alpha;           // 255 where some image saw the face
  double seen_share = 0;   // of the face's pixels
  std::size_t photos = 0;  // that it is made of
};

// Brightness is levelled between photos that see the same cells. Where photos meet, low frequencies
// fade over tens of centimetres and high ones over centimetres, so that neither steps nor doubled
// edges are seen (multi-band blending with two bands, after Burt and Adelson 1983). `mask` as
// MakeMask() has it. read(i) is asked for photos of the choice.
Orthophoto Compose(const OrthoFace& face, const cv::Mat& mask, const PhotoChoice& choice,
                   const std::vector<Photo>& photos,
                   const std::function<RawPhoto(const Photo&)>& read);

}  // namespace slcmap::exporting
