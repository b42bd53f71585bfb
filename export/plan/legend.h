// What explains a plan, below it on its sheet.
#pragma once

#include "export/plan/drawing.h"

namespace slcmap {

// Samples of walls and openings with their names, in two columns, 110 mm by 23 mm. Millimetres from
// its lower left corner.
Drawing Legend();

// Metres at a scale, some 50 mm long.
Drawing ScaleBar(int scale);

}  // namespace slcmap
