// How walls, openings and rooms are drawn in a plan, and what is written beside them.
#pragma once

#include <string>
#include <vector>

#include "export/plan/dimensions.h"
#include "export/plan/drawing.h"
#include "export/scene/building_solids.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// The areas of walls, those that were measured on both sides over the others, and the paths of
// their borders.
Drawing DrawWalls(const std::vector<WallSolid>& solids);

// Its name, if it has one, clear width, of others than passages its height, and of a window the
// sill's: "1.20 x 1.40 +0.90".
std::string OpeningText(const PlanOpening& opening, bool in_mm);

// Of a door that was walked through, its leaf and swing, at one hinge of two that it may have and
// into the room that it was seen from: which way doors open is not known. Of other doors the
// threshold, of windows the pane, of passages what is overhead.
Drawing OpeningSymbol(const WallSolid& solid, const PlanOpening& opening);

// Clear width, and height where it ends below the ceiling, of each opening, where there is room.
std::vector<DrawnText> OpeningTexts(const WallSolid& solid, const PlanTextSizes& sizes,
                                    TakenPlaces* taken);

// "W3 0.15" beside a wall: its number, which is its id, and thickness, "~" where that is assumed;
// without the thickness, or smaller, where there is no room for both.
std::vector<DrawnText> WallText(const WallSolid& solid, const PlanTextSizes& sizes,
                                TakenPlaces* taken);

// "sigma 4 mm" beside the back of a wall, where there is room.
std::vector<DrawnText> SigmaText(const WallSolid& solid, const PlanTextSizes& sizes,
                                 TakenPlaces* taken);

// What is written into the rooms of a plan.

// Name, area ("about" where a part of the border was not seen) and, where the ceiling was seen,
// height, one below the other, with how much of what was seen of the room the map holds, where that
// is little: at the place within the
// polygon that is farthest from its border among those with nothing in the way; smaller, or with
// fewer lines, in rooms that do not hold them. A room that does not hold its name has it nearby,
// with a line to it. What is placed is taken.
Drawing RoomLabel(const Room& room, const Polygon& polygon, const PlanTextSizes& sizes,
                  TakenPlaces* taken);

}  // namespace slcmap::exporting
