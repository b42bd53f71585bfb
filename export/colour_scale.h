// Colours for numbers.
#pragma once

#include "export/scene.h"

namespace slcmap {

// A colour between dark blue (0), green and yellow (1), lighter all the way, after matplotlib's
// viridis; u outside [0, 1] gets the colour of the nearer end.
Colour ScaleColour(double u);

// A colour made darker: each part times `factor` in [0, 1].
Colour Shade(const Colour& colour, double factor);

}  // namespace slcmap
