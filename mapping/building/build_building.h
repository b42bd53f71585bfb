// Planes, storeys, rooms and walls of a building, from what is known of its surfaces and of the
// space between them. README.md, "Buildings", describes the steps.
#pragma once

#include "data/core/progress.h"
#include "mapping/building/options.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

// Deterministic. Without a trajectory, or with nothing upright, the building is empty. Throws
// ConfigError for options out of their range, and StoppedError once progress says so.
Building BuildBuilding(const BuildingInput& input, const BuildingOptions& options,
                       const Progress& progress = {});

}  // namespace slcmap::mapping
