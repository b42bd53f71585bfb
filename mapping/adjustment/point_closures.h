// Places that are recognised by how points look.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/adjustment/closure.h"
#include "mapping/views/view.h"
#include "odometry/factors/point_residual.h"

namespace slcmap::inline mapping {

// Keyframes that look at a place from nearly where an earlier one did: the points of the earlier
// one are searched in the later image about where the state has them, as far as odometry's
// uncertainty goes, by the correlation of their patches. Keyframes in which enough points agree on
// one shift, and whose neighbours find the same, become closures. `images` are those of the state's
// keyframes, in their order; `geometry` is that of the rectified rig that the run's observations
// are told in. Throws StoppedError when progress says so.
std::vector<Closure> FindPointClosures(const AdjustmentState& state, const ViewImages& images,
                                       const StereoGeometry& geometry,
                                       const ClosureOptions& options,
                                       const Progress& progress = {});

}  // namespace slcmap::mapping
