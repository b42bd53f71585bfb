// How a map's files and a trajectory belong together.
#pragma once

#include <string>
#include <vector>

#include "data/rigid_transform.h"

namespace slcmap {

// The world of files that lie in a map or export folder, in that of a trajectory: a map is turned
// along its building, its run is not. Where both are of one run, by the summaries beside them, that
// tells; else it is taken to be the same world, with a warning where the map is turned against its
// run, or a summary cannot be read. Throws ConfigError where files are of different worlds.
RigidTransform TrajectoryFromMap(const std::string& trajectory,
                                 const std::vector<std::string>& mapped_files);

}  // namespace slcmap
