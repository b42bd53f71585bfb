// The report of a comparison as one HTML page that needs nothing beside it.
#pragma once

#include <string>

#include "apps/compare/comparison.h"

namespace slcmap::inline evaluation {

// Tables, bars with their spread, trajectories over the truth, line maps side by side and cost by
// stage, drawn as SVG within the page.
std::string ComparisonPage(const Comparison& comparison);

}  // namespace slcmap::evaluation
