// What is written into the rooms of a plan.
#pragma once

#include "export/plan/dimension.h"
#include "export/plan/drawing.h"
#include "export/plan/taken_places.h"
#include "mapping/building/building.h"

namespace slcmap {

// "Room 1" for the first.
std::string NameOf(const Room& room);

// Name, area ("about" where a part of the border was not seen) and, where the ceiling was seen,
// height, one below the other: at the place within the
// polygon that is farthest from its border among those with nothing in the way; smaller, or with
// fewer lines, in rooms that do not hold them. A room that does not hold its name has it nearby,
// with a line to it. What is placed is taken.
Drawing RoomLabel(const Room& room, const Polygon& polygon, const PlanTextSizes& sizes,
                  TakenPlaces* taken);

}  // namespace slcmap
