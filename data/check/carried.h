// What images show of the rig itself, or of whoever carries it.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/progress.h"
#include "data/source/sequence_source.h"

namespace slcmap {

// Masks (data/mask.h) of what stays where it is in the images while the rig turns, one a camera;
// empty where there is nothing of this kind, or the rig turns too little to tell. Images that were
// taken far apart in time and by the gyroscope look in other directions: where they show the same
// texture at the same place all the same, that is not the building. Throws StoppedError where
// progress ends it.
std::array<cv::Mat, 2> FindCarried(const SequenceSource& source,
                                   const std::vector<ImuSample>& samples, const Progress& progress);

}  // namespace slcmap
