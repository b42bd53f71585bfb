// Points of one image, searched in another one near where they are expected.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "odometry/frontend/patch.h"

namespace slcmap {

struct PatchSearchOptions {
  int patch_px = 15;
  double min_correlation = 0.8;
  int max_places = 3;  // the best that are told
  double min_apart_px = 3;
};

// Where a patch of `from` about a pixel is seen in `to`, within some pixels of a place: `warp` says
// where it is expected, and how offsets in one image look in the other. The places of best
// correlation, aligned to sub-pixels; none where the patch has no texture or reaches beyond an
// image.
std::vector<Eigen::Vector2f> SearchPatch(const cv::Mat& from, const Eigen::Vector2f& from_px,
                                         const cv::Mat& to, const PatchWarp& warp, double within_px,
                                         const PatchSearchOptions& options);

}  // namespace slcmap
