// Lines as a mesh.
#pragma once

#include "export/scene.h"

namespace slcmap {

// Adds a closed bar of square section for each edge, in the colours of its ends. Two faces of a bar
// are upright. Edges without length are left out.
void AddBars(const LineLayer& lines, double width_m, MeshLayer* layer);

}  // namespace slcmap
