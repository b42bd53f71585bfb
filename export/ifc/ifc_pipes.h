// Pipes as segments of pipes.
#pragma once

#include "export/ifc/ifc_file.h"
#include "export/ifc/ifc_structure.h"

namespace slcmap {

// Adds an IfcPipeSegment for each pipe, a circle extruded along its axis, to the storey in which
// its middle is. What it is used for is not known: columns and drums are among them. Returns how
// many without length were left out.
int AddIfcPipes(const MapResult& map, IfcStructure* structure, IfcFile* file);

}  // namespace slcmap
