// Rooms as spaces, floors and ceilings as slabs.
#pragma once

#include "export/ifc/ifc_file.h"
#include "export/ifc/ifc_options.h"
#include "export/ifc/ifc_structure.h"

namespace slcmap {

// Adds a space for each room, with its area and, where its ceiling was seen, its height and volume;
// rooms without are footprints.
void AddIfcSpaces(const Building& building, IfcStructure* structure, IfcFile* file);

// Adds a slab of assumed thickness under each floor and over each ceiling, with the outline of its
// room, whose holes it has too. Where less than two such thicknesses are between a ceiling and the
// floor above it, both take half of what there is. Returns how many had no area and were left out.
int AddIfcSlabs(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file);

}  // namespace slcmap
