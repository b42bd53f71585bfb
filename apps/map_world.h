// How a map's files and the trajectory of the run that it was made of belong together.
#pragma once

#include <string>

#include "data/rigid_transform.h"

namespace slcmap {

// The world of a mapped file, which lies in a map folder, in that of a trajectory: a map is turned
// along its building, its run is not. The same world where the trajectory is not in the folder of
// the map's run.
RigidTransform TrajectoryFromMap(const std::string& trajectory, const std::string& mapped_file);

}  // namespace slcmap
