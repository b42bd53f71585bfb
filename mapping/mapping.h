// From the keyframes and landmarks of a run to a map of the building.
#pragma once

#include "data/progress.h"
#include "mapping/map.h"
#include "mapping/options.h"
#include "odometry/run.h"

namespace slcmap {

// Builds the map of a run; of a run without landmarks, an empty one. The same run gives the same
// map, to the last bit. Once progress says so, the map is what is done so far, and not complete.
// Throws ConfigError when an option is not plausible, or would take too much memory.
MapResult BuildMap(const OdometryRun& run, const MappingOptions& options,
                   const Progress& progress = {});

}  // namespace slcmap
