// What of a map goes into a GLB file, and how.
#pragma once

namespace slcmap {

struct GltfOptions {
  bool tubes =
      false;  // lines as bars too, for viewers that show only triangles or lines a pixel wide
  bool voxels = false;     // occupied voxels as cubes
  bool quantised = false;  // positions as 16 bits of each layer's extent (KHR_mesh_quantization)
};

}  // namespace slcmap
