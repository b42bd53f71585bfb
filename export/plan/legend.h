// What explains a plan, below it on its sheet.
#pragma once

#include <optional>

#include "export/plan/drawing.h"

namespace slcmap {

// Samples of walls and openings with their names, in two columns, 110 mm by 23 mm. Millimetres from
// its lower left corner.
Drawing Legend();

// The same of what sections show.
Drawing SectionLegend();

// An arrow and what it points to, some 14 mm high, from its lower left corner: the compass' north,
// that many degrees clockwise from up, or where that is not known, up: along the building's walls,
// of maps that are far away along the y of their poses.
Drawing NorthArrow(const std::optional<double>& north_deg, bool is_far);

// Metres at a scale, some 50 mm long.
Drawing ScaleBar(int scale);

}  // namespace slcmap
