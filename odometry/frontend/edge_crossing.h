// Where the edges about a corner meet.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace slcmap {

// The point that lies nearest to the straight lines along all edges about px, weighted by their
// gradients (W. Förstner and E. Gülch, "A fast operator for detection and precise location of
// distinct points, corners and centres of circular features", 1987). Where edges meet, the image
// about that point looks the same however near the camera is; about any other point it does not,
// and as nothing in it tells the scale, alignment takes the change for a shift. Returns px where
// the point is further than a few pixels from it, or px within a few pixels of the border. The
// image has 8 bit and one channel.
Eigen::Vector2d EdgeCrossing(const cv::Mat& image, const Eigen::Vector2d& px);

}  // namespace slcmap
