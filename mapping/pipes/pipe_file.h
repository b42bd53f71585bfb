// pipes.json of a map folder.
#pragma once

#include <string>
#include <vector>

#include "mapping/pipes/map_pipe.h"

namespace slcmap {

inline constexpr char kPipeFile[] = "pipes.json";

// A list of pipes with what MapPipe holds under its names, the axis by name. Throws OutputError.
void WritePipes(const std::string& path, const std::vector<MapPipe>& pipes);

// Throws DataError naming the file, the pipe and the key for values that cannot be.
std::vector<MapPipe> ReadPipes(const std::string& path);

}  // namespace slcmap
