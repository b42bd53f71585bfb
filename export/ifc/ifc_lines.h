// Lines as annotations, and as thin solids.
#pragma once

#include "export/ifc/ifc_file.h"
#include "export/ifc/ifc_options.h"
#include "export/ifc/ifc_structure.h"

namespace slcmap {

// Adds an annotation for the lines of a storey and an axis, as one set of curves, and with
// options.line_solids a proxy for the same lines as bars; both say of each line its id, kind and
// sigma, in the order of the curves. Returns how many lines without length
// were left out. Throws StoppedError when progress says so.
int AddIfcLines(const MapResult& map, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file, const Progress& progress);

}  // namespace slcmap
