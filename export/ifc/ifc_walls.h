// Walls with their openings and doors.
#pragma once

#include "export/ifc/ifc_file.h"
#include "export/ifc/ifc_options.h"
#include "export/ifc/ifc_structure.h"

namespace slcmap {

// Adds the walls of a building: each as a box from its storey's floor to the ceiling, behind its
// measured face; its openings; and a door, without a shape, in each that was walked through or has
// the form of one. Returns how many walls without length and openings beside their wall were left
// out.
int AddIfcWalls(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file);

}  // namespace slcmap
