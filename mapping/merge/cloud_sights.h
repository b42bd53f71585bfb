// What views see of a cloud of points, where their own depth is no longer known.
#pragma once

#include <vector>

#include "data/progress.h"
#include "data/trajectory.h"
#include "mapping/building/building_input.h"
#include "mapping/dense/dense_point.h"
#include "mapping/occupancy_map.h"

namespace slcmap {

// For each pose of a rectified rig the nearest points of the cloud, one in each cell of the left
// image, that face the camera and that nothing nearer hides, as far as the way to them is known to
// be free: a blank wall has no points, but nothing was measured through it either. Each point is a
// piece of surface of size_m. Throws StoppedError once progress says so.
std::vector<Sights> SightsOfCloud(const Trajectory& poses, const Rig& rig,
                                  const std::vector<DensePoint>& cloud, double size_m,
                                  const OccupancyMap& occupancy, const Progress& progress = {});

}  // namespace slcmap
