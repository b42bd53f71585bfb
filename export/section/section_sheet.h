// Sections and elevations of a map on sheets of paper.
#pragma once

#include <vector>

#include "export/plan/sheet.h"

namespace slcmap {

// A sheet each, with the title block of plans, in the order of SectionViews; none where options ask
// for none. Throws what MakeSections does.
std::vector<Sheet> MakeSectionSheets(const MapResult& map, const PlanOptions& options);

}  // namespace slcmap
