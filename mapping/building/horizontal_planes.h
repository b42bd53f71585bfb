// Floors and ceilings of rooms.
#pragma once

#include <vector>

#include "mapping/building/options.h"
#include "mapping/building/storeys.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

// Measures the floor and the ceiling of a room of a level, sets its heights and adds the planes of
// those that were seen, with ids that go on from those there are. A room's height is that at which
// most of the level surface in it is (2 cm), away from its floor for the ceiling; where little is
// seen there, that at which lines lie along its border above; where nothing is, about the height of
// the storey's ceiling, if that is known.
void AddFloorAndCeiling(const BuildingInput& input, const Level& level, Room* room,
                        std::vector<BuildingPlane>* planes);

}  // namespace slcmap::mapping
