// What was built otherwise than it was planned, drawn over the plan of a storey.
#pragma once

#include "export/plan/dimensions.h"
#include "export/plan/drawing.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// In the frame of StoreyPlan: where deviating and missing walls and openings were planned, dashed;
// by how many millimetres they are off, with the standard deviation, and which are missing or new.
// Nothing of a storey that was not held against a plan.
Drawing DrawPlanDeviations(const MapResult& map, const Storey& storey, const PlanTextSizes& sizes);

}  // namespace slcmap::exporting
