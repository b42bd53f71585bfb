// From the keyframes and landmarks of a run to a map of the building.
#pragma once

#include "mapping/map.h"
#include "mapping/options.h"
#include "odometry/run.h"

namespace slcmap {

// Builds the map of a run; of a run without landmarks, an empty one. The same run gives the same
// map, to the last bit. Throws ConfigError when an option is not plausible.
MapResult BuildMap(const OdometryRun& run, const MappingOptions& options);

}  // namespace slcmap
