// What one rectified rig saw, as if another one like it had seen it.
#pragma once

#include <vector>

#include "data/types.h"
#include "mapping/line_evidence.h"
#include "mapping/point_observation.h"

namespace slcmap {

// Whether two rigs are one but for what calibrations of it may differ by: centres of cameras within
// 5 mm, their directions within a degree.
bool IsSameRig(const Rig& a, const Rig& b);

// Move pixels from the images of one rig into those of another that is the same. They may then lie
// beyond the border of the image by what the calibrations differ by.
std::vector<LineSupport> SupportsInRig(std::vector<LineSupport> supports, const Rig& from,
                                       const Rig& to);
std::vector<MapPointObservation> ObservationsInRig(std::vector<MapPointObservation> observations,
                                                   const Rig& from, const Rig& to);

}  // namespace slcmap
