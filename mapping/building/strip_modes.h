// Offsets in strips along a heading, and chains of them from strip to strip.
#pragma once

#include <vector>

#include "mapping/building/face_fit.h"

namespace slcmap {

// Chains of offsets that go on from strip to strip, each as the strips of a face to be fitted.
// Samples of one side of a heading, sorted by s.
std::vector<std::vector<StripMean>> FollowOffsets(const std::vector<HeadedSample>& samples,
                                                  const BuildingOptions& options);

}  // namespace slcmap
