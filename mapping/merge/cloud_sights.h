// What views see of a cloud of points, where their own depth is no longer known.
#pragma once

#include <vector>

#include "data/progress.h"
#include "data/trajectory.h"
#include "mapping/building/building_input.h"
#include "mapping/dense/dense_point.h"

namespace slcmap {

// For each pose of a rectified rig the nearest points of the cloud, one in each cell of the left
// image, that face the camera and that nothing nearer hides. Each point is a piece of surface of
// size_m. Throws StoppedError once progress says so.
std::vector<Sights> SightsOfCloud(const Trajectory& poses, const Rig& rig,
                                  const std::vector<DensePoint>& cloud, double size_m,
                                  const Progress& progress = {});

}  // namespace slcmap
