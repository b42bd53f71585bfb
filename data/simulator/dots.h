// The dots that the emitter of a simulated depth camera throws.
#pragma once

#include <opencv2/core/mat.hpp>

#include "data/core/types.h"

namespace slcmap::inline data {

// Adds to a camera's radiance what dots light, from a projector in the middle between the cameras
// that looks as the left one does. depth_m: float, along that camera's optical axis, 0: nothing.
void AddDots(const Rig& rig, int camera, const cv::Mat& depth_m, cv::Mat* radiance);

}  // namespace slcmap::data
