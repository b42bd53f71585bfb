// The world of a map: x and y along the main heading of the building.
#pragma once

#include "odometry/run.h"

namespace slcmap {

// Turns all of a run about z so that the axes of the Manhattan world that most length of lines
// follows are x and y, by at most 45 degrees. Returns the turn, T_turned_run: none of a run that
// knows no heading, as of poses that were given, whose world somebody may have surveyed.
RigidTransform TurnAlongBuilding(OdometryRun* run);

}  // namespace slcmap
