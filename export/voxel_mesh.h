// Voxels as a mesh.
#pragma once

#include <functional>
#include <vector>

#include "export/scene.h"

namespace slcmap {

// Adds a cube for each voxel, in the colour that colour_of gives, with darker sides in place of a
// light. A face between two voxels of one size is left out.
void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer);

}  // namespace slcmap
