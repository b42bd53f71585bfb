// Masks: which pixels of a camera show what moves with the rig instead of the building.
//
// In memory (Rig::masks) such pixels are 0 and all others 255; an empty mask leaves out nothing. In
// files, as OpenVINS has them, they are white.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "data/core/types.h"

namespace slcmap::inline data {

// Reads masks, one a camera of the rig (or that of the left one alone), into the rig. The word
// "none" stands for no file: then nothing is looked for either. Throws DataError for files that are
// no images of the camera's size, for a mask that leaves out nearly all, and for masks of which
// none leaves out anything.
void ReadMasks(const std::vector<std::string>& paths, Rig* rig);

inline constexpr const char* kNoMask = "none";

// The share of the image that a mask leaves out.
double LeftOut(const cv::Mat& mask);

// A mask row by row as lengths of runs, in turn of pixels that are seen and left out, from a seen
// one on; and back. MaskOfRuns throws DataError where the runs are not as many pixels.
std::vector<int> CollectRuns(const cv::Mat& mask);
cv::Mat MaskOfRuns(const std::vector<int>& runs, const Camera& camera, const std::string& place);

}  // namespace slcmap::data
