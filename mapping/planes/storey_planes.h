// Floors and ceilings of a storey beyond its rooms.
#pragma once

#include <vector>

#include "data/progress.h"
#include "mapping/building/building.h"
#include "mapping/building/building_input.h"
#include "mapping/planes/bounded_plane.h"

namespace slcmap {

// At the heights of each storey's floor and ceiling, where rays went between these and no room of
// it is near: rooms whose walls were not all seen are none, but their floors are looked at all the
// same. Throws StoppedError once progress says so. Their height is not known better than a
// storey's, so they hold only what is measured around.
std::vector<BoundedPlane> StoreyPlanes(const Building& building, const std::vector<Sights>& sights,
                                       const PlaneOptions& options, const Progress& progress = {});

}  // namespace slcmap
