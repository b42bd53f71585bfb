// Walls with their openings and doors.
#pragma once

#include "export/ifc/ifc_file.h"
#include "export/ifc/ifc_options.h"
#include "export/ifc/ifc_structure.h"

namespace slcmap {

// Adds the walls of a building: each from its storey's floor to the ceiling, behind its measured
// face, with backs that meet those of its neighbours at corners; its openings; and a door or a
// window, without a shape, in each that is one: passages stay open. Returns how many walls without
// length and openings beside their wall were left out.
int AddIfcWalls(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file);

}  // namespace slcmap
