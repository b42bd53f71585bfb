// A camera as a pyramid.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/camera.h"

namespace slcmap {

// The image's corners at a depth in metres, in the camera frame, from the top left one clockwise;
// none when the camera has no calibration.
std::vector<Eigen::Vector3d> FrustumCorners(const Camera& camera, double depth_m);

}  // namespace slcmap
