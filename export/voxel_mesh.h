// Voxels as a mesh.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "data/progress.h"
#include "export/scene.h"

namespace slcmap {

// Adds a cube for each voxel, in the colour that colour_of gives, with darker sides in place of a
// light. A face between two voxels of one size is left out. Throws StoppedError when progress says
// so.
void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer,
               const Progress& progress = {});

// The number of vertices that AddVoxels adds.
int64_t CountVoxelVertices(const std::vector<Voxel>& voxels);

}  // namespace slcmap
