// Pipes as things that can be drawn.
#pragma once

#include "export/scene.h"

namespace slcmap {

inline constexpr Colour kPipeColour{176, 122, 74};

// The axis as a line of kind pipe, with the pipe's id.
MapLine MakeAxisLine(const MapPipe& pipe);

// Adds a closed tube.
void AddTube(const MapPipe& pipe, const Colour& colour, MeshLayer* layer);

}  // namespace slcmap
