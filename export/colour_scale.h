// Colours for numbers.
#pragma once

#include "export/scene.h"

namespace slcmap {

// A colour from blue (0) over green and yellow to orange (1); u outside [0, 1] gets the colour of
// the nearer end.
Colour ScaleColour(double u);

// A colour made darker: each part times `factor` in [0, 1].
Colour Shade(const Colour& colour, double factor);

}  // namespace slcmap
